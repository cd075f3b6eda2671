"""Quirks of lines of all families: they are otherwise than the gateway believes."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final, Protocol

from simulator.faults import Direction, Fault, Faults, Switch

LATE_S: Final = 2.6
"""Delay in seconds that makes a reply later than any timeout."""
SLOW_S: Final = 0.26
"""A reply that takes most of the time that it has."""
COPIED_S: Final = 3.0
"""Delay in seconds of a copy that comes after the reply timeout."""


class Line(Protocol):
    """A simulated line, with its settings and its faults."""

    settings: Any

    @property
    def faults(self) -> Faults:
        """The faults of its frames."""


def with_settings(**switches: Any) -> Callable[[Line], None]:
    """Make a quirk of other settings."""

    def turn(line: Line) -> None:
        line.settings = replace(line.settings, **switches)

    return turn


def with_late_replies(line: Line) -> None:
    """Have some replies come late."""
    line.faults.set(Switch(Fault.LATE, Direction.REPLIES, probability=0.05, delay_s=LATE_S, holds_up=True))


def with_late_copies(line: Line) -> None:
    """Have some replies come once more."""
    line.faults.set(Switch(Fault.DOUBLED, Direction.REPLIES, probability=0.1, delay_s=COPIED_S))
