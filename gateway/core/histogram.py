"""Histograms of durations: cheap enough for every frame."""

from bisect import bisect_left
from collections.abc import Sequence
from itertools import accumulate
from math import inf


class Histogram:
    """Counts durations up to each of its bounds, in seconds."""

    __slots__ = ("_bounds", "_counts", "total_s")

    def __init__(self, bounds_s: Sequence[float]) -> None:
        self._bounds = tuple(bounds_s)
        self._counts = [0] * (len(bounds_s) + 1)
        self.total_s = 0.0

    def observe(self, took_s: float) -> None:
        """Count one more."""
        self._counts[bisect_left(self._bounds, took_s)] += 1
        self.total_s += took_s

    def up_to(self) -> list[tuple[float, int]]:
        """Number of durations up to each bound; the last is infinite."""
        return list(zip((*self._bounds, inf), accumulate(self._counts), strict=True))
