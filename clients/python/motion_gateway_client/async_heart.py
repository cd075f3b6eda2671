"""Heartbeats beside a program with asyncio, as a task; `heart` is the same as a thread."""

import asyncio
from collections.abc import Awaitable, Callable
from types import TracebackType
from typing import Self


class AsyncHeart:
    """Awaits something again and again while the block runs; ends when that gives False."""

    def __init__(self, every_s: float, beat: Callable[[], Awaitable[bool]]) -> None:
        self._every_s, self._beat = every_s, beat

    async def __aenter__(self) -> Self:
        """Begin to beat."""
        self._task = asyncio.create_task(self._run(), name="heartbeat")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: object, trace: TracebackType | None
    ) -> None:
        """End it."""
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)

    async def _run(self) -> None:
        goes_on = True
        while goes_on:
            await asyncio.sleep(self._every_s)
            goes_on = await self._beat()
