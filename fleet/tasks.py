"""Ending tasks that wait in a library which now and then swallows a cancellation."""

import asyncio
from collections.abc import Collection
from typing import Any, Final

STEP_S: Final = 0.5
STEPS: Final = 6


async def end(tasks: "Collection[asyncio.Task[Any]]") -> None:
    """Cancel tasks until they are over, for three seconds at most."""
    for _ in range(STEPS):
        running = [task for task in tasks if not task.done()]
        if not running:
            return
        for task in running:
            task.cancel()
        await asyncio.wait(running, timeout=STEP_S)
