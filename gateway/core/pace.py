"""The time that long work takes still: from the speed of its line at first, then from its own pace."""

from typing import Final

EXCHANGE_BYTES: Final = 27
"""Bytes of a question and its answer, as a mean over a backup."""
TURNAROUND_S: Final = 0.004
"""Seconds from the end of a question to its answer, and from that to the next question."""
PACED: Final = 50
"""Answers after which the pace says more than the speed of the line."""


def answer_s(baud: int) -> float:
    """The seconds that a question and its answer take at a baud rate."""
    return 10 * EXCHANGE_BYTES / baud + TURNAROUND_S


def left_s(expected: int | None, done: int, took_s: float, baud: int | None) -> float | None:
    """Seconds until `expected` answers have come, of which `done` took `took_s`; None if unknown."""
    if expected is None or (done < PACED and baud is None):
        return None
    each = took_s / done if done >= PACED or baud is None else answer_s(baud)
    return round(max(0, expected - done) * each, 1)
