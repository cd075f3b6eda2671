"""Moments on the event loop's clock, told to people."""

import asyncio
from datetime import UTC, datetime
from time import time


def age_ms_of(at: float) -> float:
    """Milliseconds since a moment on the event loop's clock."""
    return round(max(0.0, asyncio.get_running_loop().time() - at) * 1000, 3)


def utc_of(at: float) -> datetime:
    """The wall time of a moment on the event loop's clock."""
    return datetime.fromtimestamp(time() - (asyncio.get_running_loop().time() - at), UTC)
