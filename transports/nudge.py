"""Waking the computer a moment before a reply is due.

An idle processor sleeps; it takes 20 to 100 microseconds to get up and to fill its caches again. At 115200
baud that is up to a twentieth of an exchange, and the line stands idle meanwhile. The event loop's own timers
keep to the millisecond only, so the operating system is told the moment (Linux timerfd).
"""

import asyncio
import contextlib
import ctypes
import os
from time import CLOCK_MONOTONIC, monotonic

LEAD_S = 150e-6
"""The computer is woken this time before the reply."""
SLEEP_S = 500e-6
"""Longest wait in seconds in which nothing falls asleep."""
FRAMES_KEPT = 1024
"""Frames whose time to the reply is known: who polls writes the same ones again and again."""

_LIBC = ctypes.CDLL(None, use_errno=True)


class _Spec(ctypes.Structure):
    """`struct itimerspec`: a period, which stays zero, and the time until the timer rings."""

    _fields_ = (
        ("period_s", ctypes.c_long),
        ("period_ns", ctypes.c_long),
        ("wait_s", ctypes.c_long),
        ("wait_ns", ctypes.c_long),
    )


class Nudge:
    """Expects a reply as long after a frame as the last one to that frame took, and wakes the loop for it.

    If it comes at another time, only a wake-up is wasted. Where the system has no such timers, the
    loop is not woken.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._timer = _timer()
        self._spec = _Spec()
        self._took_s: dict[bytes, float] = {}
        self._frame = b""
        self._written_at = 0.0
        if self._timer is not None:
            loop.add_reader(self._timer, _silence, self._timer)

    def wrote(self, frame: bytes, heard_at: float) -> None:
        """A frame has just been written; the last bytes came at `heard_at` of the monotonic clock."""
        if heard_at > self._written_at > 0:
            self._learn(heard_at - self._written_at)
        self._frame, self._written_at = frame, monotonic()
        wait_s = self._took_s.get(frame, 0.0) - LEAD_S
        if wait_s > SLEEP_S:
            self._set(wait_s)

    def close(self) -> None:
        """Stop waking the loop; closing twice is harmless."""
        timer, self._timer = self._timer, None
        if timer is not None:
            self._loop.remove_reader(timer)
            os.close(timer)

    def _learn(self, took_s: float) -> None:
        if len(self._took_s) >= FRAMES_KEPT:
            self._took_s.clear()
        self._took_s[self._frame] = took_s

    def _set(self, wait_s: float) -> None:
        if self._timer is not None:
            self._spec.wait_s, self._spec.wait_ns = int(wait_s), int(wait_s % 1 * 1e9)
            _LIBC.timerfd_settime(self._timer, 0, ctypes.byref(self._spec), None)


def _silence(timer: int) -> None:
    """The loop is awake, which is all that was wanted."""
    with contextlib.suppress(BlockingIOError):  # it was set anew meanwhile
        os.read(timer, 8)


def _timer() -> int | None:
    """Take a timer of the system, if it has any left."""
    try:
        timer: int = _LIBC.timerfd_create(CLOCK_MONOTONIC, os.O_NONBLOCK | os.O_CLOEXEC)
    except AttributeError:  # macOS
        return None
    return timer if timer >= 0 else None
