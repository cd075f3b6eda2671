"""How many requests begin in one turn of the event loop, so that a stop is heard between them."""

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Final

AT_ONCE: Final = 4
"""Those that begin together wait together: equal reads share a frame, and settings one write to the disk.

A read takes up to half a millisecond, and all that is ready in one turn is done before the next.
"""
CROWD: Final = 16
"""With more under way one begins at a time: dozens that shared a frame would be answered in one turn."""


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

    def enter(self, begin: Callable[[], None]) -> None:
        """Begin now, or in a later turn of the loop; `leave` follows when it has ended."""
        self._under_way += 1
        if self._room and not self._waiting:
            self._room -= 1
            begin()
        else:
            self._waiting.append(begin)
        if not self._turning:
            self._turning = True
            asyncio.get_running_loop().call_soon(self._turn)

    def leave(self) -> None:
        """A request has ended."""
        self._under_way -= 1

    def _turn(self) -> None:
        room = self._room = self._at_once if self._under_way <= self._crowd else 1
        while self._waiting and self._room:
            self._room -= 1
            self._waiting.popleft()()
        self._turning = self._room < room
        if self._turning:
            asyncio.get_running_loop().call_soon(self._turn)
