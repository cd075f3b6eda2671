"""Digits for ids that nobody else has. They are no secrets: to know one permits nothing."""

import os
from random import Random
from secrets import randbits
from typing import Final

_DIGITS: Final = Random(randbits(256))  # noqa: S311  # to ask the system at each request costs ten times as long
os.register_at_fork(after_in_child=lambda: _DIGITS.seed(randbits(256)))


def hex_digits(count: int) -> str:
    """Draw so many."""
    return f"{_DIGITS.getrandbits(4 * count):0{count}x}"


def sorted_by_time(at_ms: int) -> str:
    """An id for what happens at a time of the wall clock, in milliseconds: ids sort by it."""
    return f"{at_ms:012x}{hex_digits(8)}"
