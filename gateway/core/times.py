"""Moments on the event loop's clock, told to people, and waits for what may not happen in time."""

import asyncio
from collections.abc import Awaitable, Coroutine
from datetime import UTC, datetime
from time import time
from typing import Any


def age_ms_of(at: float) -> float:
    """Milliseconds since a moment on the event loop's clock."""
    return round(max(0.0, asyncio.get_running_loop().time() - at) * 1000, 3)


def utc_of(at: float) -> datetime:
    """The wall time of a moment on the event loop's clock."""
    return datetime.fromtimestamp(time() - (asyncio.get_running_loop().time() - at), UTC)


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
