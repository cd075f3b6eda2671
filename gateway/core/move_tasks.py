"""The tasks that see moves through: each is asked for, begun or refused, and followed to its end."""

import asyncio
from collections.abc import Coroutine
from typing import Any

from gateway.core.errors import GatewayError

Beginning = asyncio.Future[GatewayError | None]
"""What is known of a move when it has been taken, or refused with an error."""


class MoveTasks:
    """The tasks of all moves of a family."""

    def __init__(self) -> None:
        self._beginnings: dict[asyncio.Task[None], Beginning] = {}

    def add(self, move_id: str, work: Coroutine[Any, Any, None], beginning: Beginning) -> None:
        """See a move through; its `beginning` ends with the task at the latest."""
        task = asyncio.create_task(work, name=f"move {move_id}")
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
