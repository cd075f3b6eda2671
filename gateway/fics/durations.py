"""How long a move may take: from distances, speeds and acceleration times, never from a fixed patience."""

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

from gateway.core.errors import ControllerRefused, GatewayError
from gateway.core.lanes import Lane
from gateway.fics.axes import Coordinates, Places
from gateway.fics.conversation import STATE_FORBIDS
from gateway.fics.knowledge import Knowledge
from gateway.fics.motion_state import SMOOTH
from gateway.fics.units import RobotUnit
from protocols.fics import motor_axes, speeds
from protocols.fics.notation import AxisSystem
from protocols.fics.row import FicsCommand

PER_SECOND = {AxisSystem.MILLIMETRE: 1.0, AxisSystem.PULSE: 1000.0, AxisSystem.DEGREE: 6.0}
"""Units of position a second in mm/s, kpps and rpm (C-HOST manual 1-5)."""
PATIENCE, PATIENCE_S = 1.5, 5.0
"""A move that takes longer than so many times its reckoning, and so much more, is told to be overdue."""

ROWS: Final[Mapping[Coordinates, Sequence[FicsCommand[Any]]]] = {
    "user": (
        speeds.GetMaximumSpeeds(),
        speeds.GetSpeedPercent(),
        speeds.GetAccelerationTimes(),
        speeds.GetDecelerationTimes(),
    ),
    "motor": (
        motor_axes.GetMotorMaximumSpeeds(),
        motor_axes.GetMotorSpeedPercent(),
        motor_axes.GetMotorAccelerationTimes(),
        motor_axes.GetMotorDecelerationTimes(),
    ),
}
"""What tells the maximum speeds, the percents of them and both times of user and of motor axes."""


class AxisDuration(NamedTuple):
    """How long an axis takes."""

    speed: float
    """Units of position a second."""
    ramps_s: float
    """Both ramps at their longest."""

    def seconds(self, distance: float) -> float:
        """How long a distance takes at most."""
        return distance / self.speed + self.ramps_s if distance else 0.0


AxisDurations = dict[str, AxisDuration]


class Durations:
    """How fast the axes of a robot go, kept from when it was read until a setting may have changed."""

    def __init__(self, known: Knowledge) -> None:
        self._known = known
        self._read_at = 0
        """What `Knowledge.settings_changed` was then."""
        self._kept: dict[tuple[int, Coordinates], AxisDurations] = {}

    async def longest_s(
        self, unit: RobotUnit, coordinates: Coordinates, start: Places, target: Places
    ) -> float | None:
        """How long a move may take; None where a place or a speed is not known.

        :raises ControllerRefused: a state of the system forbids the question, and motion (C-HOST manual 1-7).
        """
        return longest_s(start, target, await self._of(unit, coordinates))

    async def _of(self, unit: RobotUnit, coordinates: Coordinates) -> AxisDurations:
        """How fast the axes of a unit go; empty where the robot does not tell it now."""
        if self._read_at != self._known.settings_changed:
            self._kept.clear()
            self._read_at = self._known.settings_changed
        key = unit.number, coordinates
        if key not in self._kept:
            try:
                self._kept[key] = await _read(unit, coordinates)
            except ControllerRefused as refused:
                if refused.error_code in STATE_FORBIDS:
                    raise  # what forbids the question forbids motion, too
                return {}
            except GatewayError:
                return {}
        return self._kept[key]


async def _read(unit: RobotUnit, coordinates: Coordinates) -> AxisDurations:
    rows = ROWS[coordinates]
    top, percent, up, down = [await unit.read(row, Lane.COMMAND) for row in rows]
    told = zip(
        unit.names(coordinates), top.speeds, percent.percents, up.times_ms, down.times_ms, strict=False
    )
    return {
        axis: AxisDuration(
            speed * PER_SECOND[unit.systems[axis]] * share / 100, SMOOTH * (up_ms + down_ms) / 1000
        )
        for axis, speed, share, up_ms, down_ms in told
        if speed > 0 and share > 0
    }


def longest_s(start: Places, target: Places | None, axes: AxisDurations) -> float | None:
    """How long a move may take; None where a place or a speed is not known."""
    longest = 0.0
    for axis, wanted in (target or {}).items():
        place, duration = start.get(axis), axes.get(axis)
        if wanted is None or place is None or duration is None:
            return None
        longest = max(longest, duration.seconds(abs(wanted - place)))
    return round(longest, 3) if target else None
