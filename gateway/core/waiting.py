"""Waiting for something that may not happen in time."""

import asyncio
from collections.abc import Awaitable, Coroutine
from typing import Any


async def happens(event: asyncio.Event, within_s: float) -> bool:
    """Wait for an event for `within_s` seconds; say whether it is set by then."""
    if event.is_set():
        return True
    try:
        async with asyncio.timeout(within_s):
            return await event.wait()
    except TimeoutError:
        return False


def together(*works: Coroutine[Any, Any, object]) -> Awaitable[object]:
    """Do all at the same time; one alone takes no task of its own."""
    return works[0] if len(works) == 1 else asyncio.gather(*works)
