"""The newest events as texts, and the order in which subscriptions read them."""

import asyncio
import logging
import zlib
from collections import OrderedDict, deque
from collections.abc import Callable
from functools import lru_cache
from time import perf_counter
from typing import NamedTuple

BLOCK = 64
"""Events that are packed together: it takes 0.2 ms, and reading one of them again 0.1 ms."""
LEVEL = 2
UNPACKED = 8
"""Blocks that are kept as they were read."""


class KeptEvent(NamedTuple):
    """An event as it is kept."""

    type: str
    subject: str
    json: str


class EventRing:
    """Keeps the newest events, numbered from the one after `begun`."""

    def __init__(self, capacity: int, begun: int = 0) -> None:
        self.first = begun + 1
        """Number of the oldest event that is kept."""
        self.last = begun
        """Number of the newest event; `begun` before the first."""
        self._capacity = capacity
        self._begun = begun
        self._packed: deque[bytes] = deque()
        """Events as compressed texts.

        Texts and bytes are nothing to the garbage collector, which would hold the loop for 100 ms to look
        through objects (decision 9).
        """
        self._dropped = 0
        """Blocks that are no longer kept."""
        self._newest: list[KeptEvent] = []
        self._block = lru_cache(UNPACKED)(self._unpack)

    def append(self, event: KeptEvent) -> None:
        """Keep one more event, for which the oldest may go."""
        self.last += 1
        self.first = max(self.first, self.last - self._capacity + 1)
        self._newest.append(event)
        if len(self._newest) == BLOCK:
            self._packed.append(zlib.compress("\n".join(map("\n".join, self._newest)).encode(), LEVEL))
            self._newest = []
        if self._begun + (self._dropped + 1) * BLOCK < self.first:
            self._packed.popleft()
            self._dropped += 1

    def __getitem__(self, number: int) -> KeptEvent:
        """Give an event, from `first` to `last`."""
        block, place = divmod(number - 1 - self._begun, BLOCK)
        if block == self._dropped + len(self._packed):
            return self._newest[place]
        return self._block(block)[place]

    def _unpack(self, block: int) -> list[KeptEvent]:
        texts = iter(zlib.decompress(self._packed[block - self._dropped]).decode().split("\n"))
        return list(map(KeptEvent, texts, texts, texts))


log = logging.getLogger(__name__)

SLICE = 128
"""Turns that follow one another before the loop has one."""
SLICE_S = 0.002
"""Turns that take longer end a slice."""
PAUSE = 3
"""Ratio of a pause to the slice before it: turns take a quarter of the time at most."""
LONGEST_PAUSE_S = 0.1

Turn = Callable[[], None]


class Turns:
    """Gives each waiting task a turn: at news, and soon where there is more to be done.

    Turns come in slices with pauses between them. All news of a pause is worth one turn, not many.
    """

    def __init__(self, clock: Callable[[], float] = perf_counter) -> None:
        self._clock = clock
        self._due: OrderedDict[object, Turn] = OrderedDict()
        self._waiting: OrderedDict[object, Turn] = OrderedDict()
        self._new = False
        self._next: asyncio.Handle | None = None

    @property
    def idle(self) -> bool:
        """True if no task waits for a turn."""
        return not self._due and not self._waiting

    def at_news(self, whose: object, turn: Turn) -> None:
        """Give the owner a turn at the next news."""
        self._waiting[whose] = turn

    def soon(self, whose: object, turn: Turn) -> None:
        """Give the owner a turn after those that are due."""
        self._due[whose] = turn
        self._go_on()

    def wake(self, whose: object) -> None:
        """Give a waiting owner a turn: there is news for it alone."""
        if turn := self._waiting.pop(whose, None):
            self.soon(whose, turn)

    def forget(self, whose: object) -> None:
        """Give the owner no turn."""
        self._waiting.pop(whose, None)
        self._due.pop(whose, None)

    def news(self) -> None:
        """Note that there is news."""
        if self._waiting:
            self._new = True
            self._go_on()

    def _go_on(self) -> None:
        if self._next is None:
            self._next = asyncio.get_running_loop().call_soon(self._slice)

    def _slice(self) -> None:
        began = self._clock()
        if self._new and not self._due:
            self._due, self._waiting, self._new = self._waiting, self._due, False
        left, now = SLICE, began
        while self._due and left and now - began <= SLICE_S:
            _, turn = self._due.popitem(last=False)
            try:
                turn()
            except Exception:  # the turns of the others come
                log.exception("a turn has met a fault of the gateway itself")
            left -= 1
            now = self._clock()
        pause_s = min(PAUSE * (now - began), LONGEST_PAUSE_S)
        self._next = asyncio.get_running_loop().call_later(pause_s, self._resume)

    def _resume(self) -> None:
        self._next = None
        if self._due or self._new:
            self._slice()
