"""How long a move may take: from distances, speeds and acceleration times, never from a fixed patience."""

from typing import TYPE_CHECKING, NamedTuple

from gateway.core.errors import GatewayError
from gateway.core.lanes import Lane
from protocols.fics import motor_axes, speeds
from protocols.fics.notation import AxisSystem

if TYPE_CHECKING:
    from gateway.fics.units import Coordinates, Places, RobotUnit

PER_SECOND = {AxisSystem.MILLIMETRE: 1.0, AxisSystem.PULSE: 1000.0, AxisSystem.DEGREE: 6.0}
"""Units of position a second in mm/s, kpps and rpm (C-HOST manual 1-5)."""
SMOOTH = 2.0
"""An S-curve takes up to so many times as long as a straight ramp: an assumption."""
PATIENCE, PATIENCE_S = 1.5, 5.0
"""A move that takes longer than so many times its reckoning, and so much more, is told to be overdue."""

ROWS = {
    "user": (
        speeds.GetMaximumSpeeds,
        speeds.GetSpeedPercent,
        speeds.GetAccelerationTimes,
        speeds.GetDecelerationTimes,
    ),
    "motor": (
        motor_axes.GetMotorMaximumSpeeds,
        motor_axes.GetMotorSpeedPercent,
        motor_axes.GetMotorAccelerationTimes,
        motor_axes.GetMotorDecelerationTimes,
    ),
}
"""What tells the maximum speeds, the percents of them and both times of user and of motor axes."""


class AxisPace(NamedTuple):
    """How fast an axis goes."""

    speed: float
    """Units of position a second."""
    ramps_s: float
    """Both ramps at their longest."""

    def seconds(self, distance: float) -> float:
        """How long a distance takes at most."""
        return distance / self.speed + self.ramps_s if distance else 0.0


Paces = dict[str, AxisPace]


async def paces_of(unit: "RobotUnit", coordinates: "Coordinates") -> Paces:
    """Read for a move how fast the axes of a unit go; what was read is kept until a setting is changed.

    Empty where the robot does not tell it now.
    """
    if coordinates not in unit.paces:
        try:
            unit.paces[coordinates] = await _read(unit, coordinates)
        except GatewayError:
            return {}
    return unit.paces[coordinates]


async def _read(unit: "RobotUnit", coordinates: "Coordinates") -> Paces:
    rows = ROWS[coordinates]
    top, percent, up, down = [await unit.robot.read(row(), unit.number, Lane.COMMAND) for row in rows]
    told = zip(
        unit.names(coordinates), top.speeds, percent.percents, up.times_ms, down.times_ms, strict=False
    )
    return {
        axis: AxisPace(
            speed * PER_SECOND[unit.systems[axis]] * share / 100, SMOOTH * (up_ms + down_ms) / 1000
        )
        for axis, speed, share, up_ms, down_ms in told
        if speed > 0 and share > 0
    }


def longest_s(start: "Places", target: "Places | None", paces: Paces) -> float | None:
    """How long a move may take; None where a place or a speed is not known."""
    longest = 0.0
    for axis, wanted in (target or {}).items():
        place, pace = start.get(axis), paces.get(axis)
        if wanted is None or place is None or pace is None:
            return None
        longest = max(longest, pace.seconds(abs(wanted - place)))
    return round(longest, 3) if target else None
