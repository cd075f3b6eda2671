"""The noise filter of one input: how long a level must last to be believed (RC-420 manual 13.9.7)."""

from math import floor

SAMPLE_S = 0.001
"""The inputs are sampled each millisecond."""

UNFILTERED = 1
"""The count that switches the filter off: the level follows the input at once."""

# A fraction of a sample, far above the rounding of any clock and far below what matters.
_ROUNDING = 1e-3


def _sample(now: float) -> int:
    """The number of the last sample taken."""
    return floor(now / SAMPLE_S + _ROUNDING)


class NoiseFilter:
    """Counts high samples up to `limit` and low ones down to 0; the level changes at either end.

    `now` is seconds and never goes back.
    """

    def __init__(self, raw: bool, limit: int, now: float) -> None:
        self.level = raw
        self._raw = raw
        self._limit = limit
        self._count = limit if raw else 0
        self._sampled = _sample(now)

    def sense(self, raw: bool, now: float) -> None:
        """Take a change of the input."""
        self.advance(now)
        self._raw = raw
        if self._limit == UNFILTERED:
            self.level, self._count = raw, int(raw)

    def advance(self, now: float) -> None:
        """Count the samples taken until now."""
        samples = _sample(now) - self._sampled
        self._sampled += samples
        if self._raw:
            self._count = min(self._limit, self._count + samples)
        else:
            self._count = max(0, self._count - samples)
        if self._count in (0, self._limit):
            self.level = self._count == self._limit

    def set_limit(self, limit: int, now: float) -> None:
        """Change the count, 1-99; counting starts anew from the level."""
        self.advance(now)
        if limit != self._limit:
            self._limit = limit
            self._count = limit if self.level else 0
            self.sense(self._raw, now)

    def changes_at(self) -> float | None:
        """When the level will follow the input, if nothing happens before."""
        if self._raw == self.level:
            return None
        missing = self._limit - self._count if self._raw else self._count
        return (self._sampled + missing) * SAMPLE_S
