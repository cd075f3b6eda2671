"""Waiting for something that may not happen in time."""

import asyncio


async def happens(event: asyncio.Event, within_s: float) -> bool:
    """Wait for an event for so many seconds; whether it is set by then."""
    try:
        async with asyncio.timeout(within_s):
            return await event.wait()
    except TimeoutError:
        return False
