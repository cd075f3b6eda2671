"""An event loop for replays: its clock jumps to the next timer, or runs as many times as fast as wanted."""

import asyncio
import heapq
import selectors
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import Context
from math import ceil
from typing import Any, Final

_A_SECOND: Final = 10_000_000
_NOISE: Final = 1e-3


def in_steps(seconds: float) -> float:
    """Round up to steps of 100 ns: a record has a time as it was, and two that were equal are again."""
    return ceil(seconds * _A_SECOND - _NOISE) / _A_SECOND


class _Selector(selectors.SelectSelector):
    """Moves the loop's clock instead of waiting, or waits a part of the time."""

    def __init__(self, speed: float | None) -> None:
        super().__init__()
        self.now = 0.0
        self._speed = speed

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        if timeout is None:
            return super().select(None)
        ready = super().select(0)
        if ready or not timeout:
            return ready
        if self._speed is not None:
            began = time.monotonic()
            ready = super().select(timeout / self._speed)
            timeout = min(timeout, (time.monotonic() - began) * self._speed) if ready else timeout
        self.now = in_steps(self.now + timeout)
        return ready


class Inline(ThreadPoolExecutor):
    """Does at once what would go to a thread: virtual time does not wait for threads."""

    def submit(self, deed: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        """Do it, and give what came of it."""
        future: Future[Any] = Future()
        try:
            future.set_result(deed(*args, **kwargs))
        except Exception as error:  # as a thread would hand it over
            future.set_exception(error)
        return future


class _Timer(asyncio.TimerHandle):
    """A timer; of those at one instant the one that was set first goes first."""

    __slots__ = ("_number",)

    def __init__(self, number: int, when: float, *more: Any) -> None:
        super().__init__(when, *more)
        self._number = number
        self._scheduled = True  # as asyncio has it

    def __lt__(self, other: object) -> bool:
        if not isinstance(other, _Timer):
            return NotImplemented
        return (self.when(), self._number) < (other.when(), other._number)


class VirtualLoop(asyncio.SelectorEventLoop):
    """A loop for ports in memory; `speed` None is as fast as possible.

    Asyncio keeps timers of one instant in no order: a second run would be another. Time goes in `in_steps`.
    """

    def __init__(self, speed: float | None = None) -> None:
        self._set = 0
        self._moving = _Selector(speed)
        super().__init__(self._moving)
        self.set_default_executor(Inline())

    def call_at(  # type: ignore[override]  # what it takes is not looked at
        self, when: float, callback: Callable[..., Any], *args: Any, context: Context | None = None
    ) -> asyncio.TimerHandle:
        """Set a timer."""
        self._set += 1
        now, stepped = self.time(), in_steps(when)
        if when > now >= stepped:  # or who waits for that time would be called again and again
            stepped = in_steps(now + 1 / _A_SECOND)
        timer = _Timer(self._set, stepped, callback, args, self, context)
        heapq.heappush(self._scheduled, timer)  # type: ignore[attr-defined]  # asyncio's own
        return timer

    def time(self) -> float:
        """The clock of the replay, in seconds from its beginning."""
        return self._moving.now
