"""Who takes up a line's time, and how much of it."""

from collections import defaultdict, deque

WINDOW_S = 10.0
"""The load is that of so many seconds."""


class Load:
    """The time of one line: a frame takes it from its first bit to the end of its reply, or the deadline."""

    def __init__(self) -> None:
        self.busy_s: defaultdict[str, float] = defaultdict(float)
        """Seconds since the start, by what they were taken for."""
        self._spans: deque[tuple[float, str, float]] = deque()
        self._work: str | None = None
        self._since = 0.0

    def begin(self, work: str, now: float) -> None:
        """A frame is written."""
        self.end(now)
        self._work, self._since = work, now

    def end(self, now: float) -> None:
        """The reply has come, or is not waited for any more."""
        if self._work is None:
            return
        took_s = now - self._since
        self.busy_s[self._work] += took_s
        self._spans.append((now, self._work, took_s))
        self._work = None
        self._forget(now)

    def percent(self, now: float) -> dict[str, float]:
        """The share of the last ten seconds that each took, in percent."""
        self._forget(now)
        taken_s: dict[str, float] = {}
        for _, work, took_s in self._spans:
            taken_s[work] = taken_s.get(work, 0.0) + took_s
        return {work: round(100 * it / WINDOW_S, 1) for work, it in sorted(taken_s.items())}

    def _forget(self, now: float) -> None:
        while self._spans and self._spans[0][0] <= now - WINDOW_S:
            self._spans.popleft()
