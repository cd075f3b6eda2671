"""Edges of the status and the sensors of a robot's motor axes: what has changed since it was last told."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from gateway.fics.axes import UnitAxes
from gateway.fics.motion_state import Tell
from protocols.fics.notation import driver_error_text
from protocols.fics.row import FicsCommand
from protocols.fics.status import SENSOR_BITS, AxisSensors, AxisStatus, AxisStatuses, SensorStates

TOLD_BITS: Final = ("origin_done", "servo_ready", "alarm")
"""That an axis moves is told by its move."""


@dataclass(eq=False)
class AxisEdges:
    """The motor axes of one robot as they were last told; what is told first is no edge."""

    _tell: Tell
    _last: dict[tuple[int, str], Sequence[Any]] = field(default_factory=dict, init=False)
    """By unit and event type, what was told last of each axis."""

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
        return [(axis, was, it) for axis, was, it in axes if was != it]


def _status(axis: AxisStatus) -> dict[str, Any]:
    bits = [bit for bit in TOLD_BITS if getattr(axis, bit)]
    return {"status": bits, "driver_error": driver_error_text(axis.driver_error)}
