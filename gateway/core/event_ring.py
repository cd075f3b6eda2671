"""The newest events as texts: what is not quite new is packed, to a tenth of its size."""

import zlib
from collections import deque
from functools import lru_cache
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
