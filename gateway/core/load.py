"""The load of a line: how much of its time each kind of work takes, and histograms of durations."""

from bisect import bisect_left
from collections import defaultdict, deque
from collections.abc import Sequence
from itertools import accumulate
from math import inf
from typing import Final


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


WINDOW_S = 10.0
"""Seconds over which the load is measured."""
TOOK_BOUNDS_S: Final = (0.001, 0.0025, 0.005, 0.01, 0.02, 0.03, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5)


class Load:
    """The time of one line: a frame takes it from its first bit to the end of its reply, or the deadline."""

    def __init__(self) -> None:
        self.busy_s: defaultdict[str, float] = defaultdict(float)
        """Seconds since the start, by what they were taken for."""
        self.took = Histogram(TOOK_BOUNDS_S)
        """Seconds that each frame has taken the line."""
        self._spans: deque[tuple[float, str, int]] = deque()
        self._lately_ns: defaultdict[str, int] = defaultdict(int)
        """The sums of these spans: whole numbers, so that nothing is left of what has passed."""
        self._busy_with: str | None = None
        """Why the line is busy now, if it is."""
        self._busy_since = 0.0

    def begin(self, work: str, now: float) -> None:
        """Note that a frame goes out, for this kind of work."""
        if self._busy_with is not None:
            self.note(self._busy_with, self._busy_since, now)
        self._busy_with, self._busy_since = work, now

    def end(self, now: float) -> None:
        """Note that the line is free again."""
        if self._busy_with is not None:
            self.note(self._busy_with, self._busy_since, now)
            self._busy_with = None

    def note(self, work: str, since: float, now: float) -> None:
        """A frame was written, and its reply has come, or is not waited for any more."""
        took_s = now - since
        took_ns = round(took_s * 1e9)
        self.busy_s[work] += took_s
        self._spans.append((now, work, took_ns))
        self._lately_ns[work] += took_ns
        if self._spans[0][0] <= now - WINDOW_S:
            self._forget(now)
        self.took.observe(took_s)

    def percent(self, now: float) -> dict[str, float]:
        """The share of the last ten seconds that each took, in percent."""
        self._forget(now)
        return {work: round(1e-7 * ns / WINDOW_S, 1) for work, ns in sorted(self._lately_ns.items())}

    def _forget(self, now: float) -> None:
        while self._spans and self._spans[0][0] <= now - WINDOW_S:
            _, work, took_ns = self._spans.popleft()
            self._lately_ns[work] -= took_ns
            if not self._lately_ns[work]:
                del self._lately_ns[work]
