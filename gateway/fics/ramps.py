"""How long the axes of a robot may take to come to rest: its deceleration times (C-HOST manual 2-32, 4-8)."""

from collections.abc import Sequence
from typing import Any, Final

from gateway.fics.axes import UnitAxes
from protocols.fics.axis_settings import AxisTimes
from protocols.fics.motor_axes import GetMotorDecelerationTimes
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import GetDecelerationTimes

SMOOTH = 2.0
"""An S-curve takes up to so many times as long as a straight ramp: an assumption."""
QUESTIONS: Final[Sequence[FicsCommand[AxisTimes]]] = (GetDecelerationTimes(), GetMotorDecelerationTimes())
_CODES: Final = frozenset(it.code for it in QUESTIONS)
"""Of the questions, and of the commands that set the times."""


class Ramps:
    """The deceleration times of a robot as told last: in motion it tells none (C-HOST manual 1-7)."""

    def __init__(self) -> None:
        self._times_ms: dict[tuple[int, str], Sequence[float]] = {}
        """By unit and command."""

    @property
    def longest_s(self) -> float | None:
        """The seconds that a decelerating stop may take; None where the robot has told nothing."""
        times_ms = [time for times in self._times_ms.values() for time in times]
        return SMOOTH * max(times_ms) / 1000 if times_ms else None

    def unknown_of(self, unit: UnitAxes) -> list[FicsCommand[AxisTimes]]:
        """The questions that a unit has not answered yet."""
        return [it for it in QUESTIONS if (unit.number, it.code) not in self._times_ms]

    def note(self, unit: UnitAxes, command: FicsCommand[Any], reply: AxisTimes) -> None:
        """Note what a unit has told, whoever has asked."""
        if command.code in _CODES:
            self._times_ms[unit.number, command.code] = reply.times_ms

    def forget(self) -> None:
        """Believe them no more: settings that were not stored are lost with the power."""
        self._times_ms.clear()
