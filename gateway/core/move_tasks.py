"""The tasks that see moves through: each is asked for, begun or refused, and followed to its end."""

import asyncio
import logging
from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any

from gateway.core.errors import GatewayError
from gateway.core.own_faults import at_end_of, survived

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
        task = asyncio.create_task(work(), name=f"move {move_id}")
        self._beginnings[task] = beginning
        at_end_of(task, f"the end of move {move_id}", partial(self._over, task, move_id, give_up))

    def _over(self, task: asyncio.Task[None], move_id: str, give_up: GiveUp) -> None:
        beginning = self._beginnings.pop(task)
        fault = None if task.cancelled() else task.exception()
        if isinstance(fault, Exception):
            _not_followed(move_id, fault, give_up)
            if not beginning.done():
                beginning.set_exception(fault)
        beginning.cancel()

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


async def guarded(move_id: str, work: Callable[[], Coroutine[Any, Any, None]], give_up: GiveUp) -> None:
    """Follow one of several moves: a fault of the gateway itself ends the watch over this one alone."""
    try:
        await work()
    except Exception as fault:
        _not_followed(move_id, fault, give_up)


def _not_followed(move_id: str, fault: Exception, give_up: GiveUp) -> None:
    log.error("move %s has met a fault of the gateway itself", move_id, exc_info=fault)
    why = f"A fault of the gateway itself ({type(fault).__name__}) has ended its watch over the move."
    survived(f"move {move_id}", partial(give_up, why))
