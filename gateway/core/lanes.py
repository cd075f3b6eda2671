"""The lanes of a line, by priority."""

from enum import IntEnum

from gateway.core.errors import QueueFull
from protocols.members import at_hand


@at_hand
class Lane(IntEnum):
    """Priority on a line: the lower number goes first."""

    STOP = 0
    VERIFY = 1
    """Questions a motor waits for: whether a stop has worked, and what is to be known before a move."""
    COMMAND = 2
    STOP_REPEAT = 3
    """Stops repeated to a body that has not answered the last one and may be dead."""
    READ = 4
    BACKGROUND = 5
    """Questions of the gateway itself: health, and whether a motor still runs."""


STOPS = (Lane.STOP, Lane.STOP_REPEAT)
QUESTIONS = (Lane.READ, Lane.VERIFY, Lane.BACKGROUND)
IMPATIENT = (Lane.COMMAND, Lane.READ, Lane.BACKGROUND)
"""Lanes whose exchanges expire; each gets a turn before that."""

QUEUE_LIMIT = 64
"""Exchanges that may wait for one body, or robot, in one lane."""


def require_room(waiting: int, waits_for: str) -> None:
    """Turn away what would wait too long.

    :raises QueueFull: as many as may wait do so already.
    """
    if waiting >= QUEUE_LIMIT:
        raise QueueFull(
            f"{QUEUE_LIMIT} requests wait for this {waits_for} already; nothing was sent.", "Try again later."
        )
