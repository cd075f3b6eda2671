"""Digits for unique ids. They are no secrets: to know one permits nothing."""

import os
from datetime import datetime
from random import Random
from secrets import randbits
from typing import Final

_DIGITS: Final = Random(randbits(256))  # noqa: S311  # to ask the system at each request costs ten times as long
os.register_at_fork(after_in_child=lambda: _DIGITS.seed(randbits(256)))


def hex_digits(count: int) -> str:
    """Draw `count` digits."""
    return f"{_DIGITS.getrandbits(4 * count):0{count}x}"


class _ByTime:
    """Ids that sort in the order in which they are drawn, whatever becomes of the clock."""

    def __init__(self) -> None:
        self._last = 0

    def draw(self, at_ms: int) -> str:
        """An id for what happens at a time of the wall clock, in milliseconds."""
        self._last = max(at_ms << 32 | _DIGITS.getrandbits(32), self._last + 1)
        return f"{self._last:020x}"

    def go_on_after(self, drawn: str) -> None:
        """Draw none that sorts before this one of an earlier life, whose clock may have been ahead."""
        self._last = max(self._last, int(drawn, 16))


_BY_TIME: Final = _ByTime()
sorted_by_time: Final = _BY_TIME.draw
"""Draws an id for a time of the wall clock, in milliseconds: ids sort by it."""
go_on_after: Final = _BY_TIME.go_on_after


def new_id(now: datetime) -> str:
    """Draw an id for something that begins now."""
    return sorted_by_time(int(now.timestamp() * 1000))
