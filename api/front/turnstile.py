"""The number of requests that begin in one turn of the event loop, so that a stop is heard between them."""

import asyncio
from collections import deque
from collections.abc import Callable
from time import thread_time
from typing import Final

AT_ONCE: Final = 4
"""Requests that begin together wait together: equal reads share a frame, and settings one write to the disk.

A read takes up to half a millisecond, and all that is ready in one turn is done before the next.
"""
CROWD: Final = 16
"""The most requests under way with which several begin in a turn: dozens would be answered in one turn."""


LONG_TURN_S: Final = 0.002
"""The longest turn, in seconds of the processor, after which several requests begin at once."""
STOP_PAUSE_S: Final = 0.005
"""While a stop is under way one request begins in this time: a stop takes a dozen turns to its answer, ..."""
STOP_TURNS: Final = 4
"""... and in this number of turns of the loop, for time passes without any on a busy processor."""


def after_pause(do: Callable[[], None]) -> None:
    """Do it when a stop that is under way has had time, and turns of the loop."""
    asyncio.get_running_loop().call_later(STOP_PAUSE_S, _after_turns, STOP_TURNS, do)


def _after_turns(turns: int, do: Callable[[], None]) -> None:
    if turns:
        asyncio.get_running_loop().call_soon(_after_turns, turns - 1, do)
    else:
        do()


class Turnstile:
    """Lets a few requests begin in each turn of the loop, in the order in which they came.

    Without it the requests of 200 clients that ask at once all come before a stop that is read meanwhile.
    """

    def __init__(self, at_once: int = AT_ONCE, crowd: int = CROWD) -> None:
        self._at_once = self._room = at_once
        self._crowd = crowd
        self._under_way = 0
        """Requests that have come and have not ended."""
        self._waiting: deque[Callable[[], None]] = deque()
        self._turning = False
        self._used_s = 0.0
        """Processor time at the last turn."""
        self.stops = 0
        """Stops under way: they do not pass here, but all others give way to them."""

    def enter(self, begin: Callable[[], None]) -> None:
        """Begin now, or in a later turn of the loop; `leave` follows when it has ended."""
        self._under_way += 1
        if self._room and not self._waiting and not self.stops:
            self._room -= 1
            begin()
        else:
            self._waiting.append(begin)
        if not self._turning:
            self._turning = True
            self._used_s = thread_time()
            self._turn_later()

    def leave(self) -> None:
        """A request has ended."""
        self._under_way -= 1

    def begin_stop(self) -> None:
        """Let others begin less often from now on."""
        self.stops += 1

    def end_stop(self) -> None:
        """A stop has its answer."""
        self.stops -= 1

    def _turn_later(self) -> None:
        if self.stops:
            after_pause(self._turn)
        else:
            asyncio.get_running_loop().call_soon(self._turn)

    def _turn(self) -> None:
        used_s = thread_time()
        long = used_s - self._used_s > LONG_TURN_S
        self._used_s = used_s
        alone = self.stops or long or self._under_way > self._crowd
        room = self._room = 1 if alone else self._at_once
        while self._waiting and self._room:
            self._room -= 1
            self._waiting.popleft()()
        self._turning = self._room < room
        if self._turning:
            self._turn_later()
