"""What the bits of ACD and ASD mean on a robot, and whether what it shows bears that out.

The figures that name them are lost (C-HOST manual 2-10, 2-11), so their order is a setting.
"""

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from gateway.fics.exchange import Outcome, RobotAnswered
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
"""What a homed axis shows that stands still without an error."""
TELLS_MOTION = {(True, True), (False, False)}
"""Whether an axis was at work by the first digit of ACD, and moved by the second: what bears that bit out."""


@dataclass(eq=False)
class Bits:
    """The order of the bits of one robot, lowest first."""

    status: tuple[str, ...] = STATUS_BITS
    sensors: tuple[str, ...] = SENSOR_BITS
    mismatches: dict[int, str] = field(default_factory=dict)
    """By unit, what it showed at rest that does not go with their order."""
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
        """Whether an axis may be on its way, where only the bit `moving` tells (C-HOST manual 2-10).

        It says otherwise only of a robot that has shown it in motion, and never at rest.
        """
        return axis.moving or self._motion_shown - {(True, False)} != TELLS_MOTION

    def may_brake(self, axes: Iterable[AxisStatus]) -> bool:
        """Whether an axis may still be on its way in an emergency stop (C-HOST manual 2-10)."""
        return any(axis.motion_mode == MotionMode.STOPPED and self.may_move(axis) for axis in axes)

    def compare_again(self) -> None:
        """The robot was set up, or will be homed."""
        self._compared.clear()

    def is_due(self, unit: int) -> bool:
        """Whether a unit was not compared yet."""
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
