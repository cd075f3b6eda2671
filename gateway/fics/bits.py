"""The bits of ACD and ASD of one robot: what they mean, whether the robot bears that out, what has changed.

The figures that name them are lost (C-HOST manual 2-10, 2-11), so their order is a setting.
"""

import logging
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from gateway.fics.axes import Tell, UnitAxes
from gateway.fics.exchange import Outcome, RobotAnswered
from protocols.fics.notation import driver_error_text
from protocols.fics.row import FicsCommand
from protocols.fics.status import (
    SENSOR_BITS,
    STATUS_BITS,
    AxisSensors,
    AxisStatus,
    AxisStatuses,
    GetAxisSensors,
    GetAxisStatus,
    MotionMode,
    SensorStates,
    rename_bits,
)
from protocols.table import Reply

log = logging.getLogger(__name__)

BITS_TOLD_BY: Final = GetAxisStatus, GetAxisSensors
"""The questions that are answered with bits."""
AT_REST: Mapping[str, bool] = {"origin_done": True, "servo_ready": True, "moving": False, "alarm": False}
"""The bits of a homed axis that stands still without an error."""
TELLS_MOTION = {(True, True), (False, False)}
"""The pairs of (at work by the first digit of ACD, moved by the second) that bear the second out."""


@dataclass(eq=False)
class Bits:
    """The order of the bits of one robot, lowest first."""

    status: tuple[str, ...] = STATUS_BITS
    sensors: tuple[str, ...] = SENSOR_BITS
    mismatches: dict[int, str] = field(default_factory=dict)
    """The bits of a unit at rest that do not go with their order, as a sentence, by unit."""
    _compared: set[int] = field(default_factory=set)
    _motion_shown: set[tuple[bool, bool]] = field(default_factory=set)

    def read(self, outcome: Outcome) -> Outcome:
        """Name the bits of an answer as they are ordered here."""
        if not isinstance(outcome, RobotAnswered):
            return outcome
        if (self.status, self.sensors) != (STATUS_BITS, SENSOR_BITS):
            outcome = replace(outcome, replies=tuple(map(self._named, outcome.replies)))
        for reply in outcome.replies:
            if isinstance(reply, AxisStatuses):
                self._learn(reply.axes)
        return outcome

    def _named(self, reply: Reply) -> Reply:
        usual, here = STATUS_BITS + SENSOR_BITS, self.status + self.sensors
        if isinstance(reply, AxisStatuses):
            return AxisStatuses(axes=[rename_bits(axis, usual, here) for axis in reply.axes])
        if isinstance(reply, SensorStates):
            return SensorStates(axes=[rename_bits(axis, usual, here) for axis in reply.axes])
        return reply

    # whether a robot bears it out

    def _learn(self, axes: Iterable[AxisStatus]) -> None:
        self._motion_shown |= {
            (axis.motion_mode != MotionMode.STANDING, axis.moving)
            for axis in axes
            if axis.motion_mode != MotionMode.STOPPED
        }

    def may_move(self, axis: AxisStatus) -> bool:
        """True if an axis may be on its way, where only the bit `moving` tells (C-HOST manual 2-10).

        It says otherwise only of a robot that has shown it in motion, and never at rest.
        """
        return axis.moving or self._motion_shown - {(True, False)} != TELLS_MOTION

    def may_brake(self, axes: Iterable[AxisStatus]) -> bool:
        """True if an axis may still be on its way in an emergency stop (C-HOST manual 2-10)."""
        return any(axis.motion_mode == MotionMode.STOPPED and self.may_move(axis) for axis in axes)

    def compare_again(self) -> None:
        """The robot was set up, or will be homed."""
        self._compared.clear()

    def is_due(self, unit: int) -> bool:
        """True if a unit was not compared yet."""
        return unit not in self._compared

    def was_looked_at(self, unit: int) -> None:
        """A unit was at rest; it is compared if it was homed, and else after its homing."""
        self._compared.add(unit)

    def compare(
        self, unit: int, axes: Mapping[str, AxisStatus], sensors: Mapping[str, AxisSensors]
    ) -> str | None:
        """Compare what a homed unit shows at rest; gives what does not fit where that is news."""
        wrong = [
            f"axis {name} shows {bit} {'off' if wanted else 'on'}"
            for name, axis in axes.items()
            for bit, wanted in AT_REST.items()
            if getattr(axis, bit) is not wanted
        ]
        wrong += [
            f"axis {name} shows {bit} on"
            for name, axis in sensors.items()
            for bit in ("plus_limit", "minus_limit")
            if getattr(axis, bit)
        ]
        before = self.mismatches.pop(unit, None)
        if not wrong:
            return None
        self.mismatches[unit] = told = (
            f"Unit {unit} stands still, homed and without an error, but {', '.join(wrong)}: see whether "
            "status_bits and sensor_bits of the configuration are those of this robot."
        )
        if told == before:
            return None
        log.warning("%s", told)
        return told


# edges

TOLD_BITS: Final = ("origin_done", "servo_ready", "alarm")
"""The bits whose edges are events; the move of an axis tells that it moves."""


@dataclass(eq=False)
class AxisEdges:
    """The motor axes of one robot as they were last told; what is told first is no edge."""

    _tell: Tell
    _last: dict[tuple[int, str], Sequence[Any]] = field(default_factory=dict, init=False)
    """The last reading of each axis, by unit and event type."""

    def note_status(self, unit: UnitAxes, _: FicsCommand[Any], reply: AxisStatuses) -> None:
        """A unit has told its status (ACD)."""
        told = [_status(axis) for axis in reply.axes]
        for axis, _was, now in self._changes(unit, "robot.status.changed", told):
            self._tell("robot.status.changed", {"unit": unit.number, "axis": axis, **now})

    def note_sensors(self, unit: UnitAxes, _: FicsCommand[Any], reply: SensorStates) -> None:
        """A unit has told its sensors (ASD)."""
        for axis, before, now in self._changes(unit, "robot.sensor.changed", reply.axes):
            self._tell_sensors(unit.number, axis, before, now)

    def _tell_sensors(self, unit: int, axis: str, before: AxisSensors, now: AxisSensors) -> None:
        for sensor in SENSOR_BITS:
            on = getattr(now, sensor)
            if on is not getattr(before, sensor):
                edge = {"unit": unit, "axis": axis, "sensor": sensor, "on": on}
                self._tell("robot.sensor.changed", edge)

    def _changes(self, unit: UnitAxes, what: str, now: Sequence[Any]) -> list[tuple[str, Any, Any]]:
        """The axes that were told otherwise before, each with what was told then and now."""
        before = self._last.get((unit.number, what), now)
        self._last[unit.number, what] = now
        axes = zip(unit.motor_axes, before, now, strict=False)
        return [(axis, was, now) for axis, was, now in axes if was != now]


def _status(axis: AxisStatus) -> dict[str, Any]:
    bits = [bit for bit in TOLD_BITS if getattr(axis, bit)]
    return {"status": bits, "driver_error": driver_error_text(axis.driver_error)}
