"""The tasks that see moves through: each is asked for, begun or refused, and followed to its end."""

import asyncio
import logging
from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any

from gateway.core.errors import GatewayError
from gateway.core.own_faults import survived

log = logging.getLogger(__name__)

GiveUp = Callable[[str], None]
"""Says that nobody knows how a move ends, and why."""
Beginning = asyncio.Future[GatewayError | None]
"""What is known of a move when it has been taken, or refused with an error."""


class MoveTasks:
    """The tasks of all moves of a family."""

    def __init__(self) -> None:
        self._beginnings: dict[asyncio.Task[None], Beginning] = {}

    def add(
        self,
        move_id: str,
        work: Callable[[], Coroutine[Any, Any, None]],
        beginning: Beginning,
        give_up: GiveUp,
    ) -> None:
        """See a move through; its `beginning` ends with the task at the latest.

        After a fault of the gateway itself nobody follows the move: `give_up` is called.
        """
        task = asyncio.create_task(_seen_through(move_id, work, beginning, give_up), name=f"move {move_id}")
        self._beginnings[task] = beginning
        task.add_done_callback(self._beginnings.pop)
        task.add_done_callback(lambda _: beginning.cancel())

    async def begun(self) -> None:
        """Wait until every move that was asked for has been taken or refused."""
        if self._beginnings:
            await asyncio.wait(self._beginnings.values())

    async def close(self) -> None:
        """Follow no more, once all have begun."""
        await self.begun()
        tasks = list(self._beginnings)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _seen_through(
    move_id: str, work: Callable[[], Coroutine[Any, Any, None]], beginning: Beginning, give_up: GiveUp
) -> None:
    fault = await guarded(move_id, work, give_up)
    if fault is not None and not beginning.done():
        beginning.set_exception(fault)


async def guarded(
    move_id: str, work: Callable[[], Coroutine[Any, Any, None]], give_up: GiveUp
) -> Exception | None:
    """Follow a move; after a fault of the gateway itself, which it gives, nobody does, and that is said."""
    try:
        await work()
    except Exception as fault:
        log.exception("move %s has met a fault of the gateway itself", move_id)
        why = f"A fault of the gateway itself ({type(fault).__name__}) has ended its watch over the move."
        survived(f"move {move_id}", partial(give_up, why))
        return fault
    return None
