"""Settings of axes, each with its query (C-HOST manual 2-15, 2-24 to 2-34, 4-5 to 4-10)."""

from collections.abc import Callable, Sequence
from typing import Any

from protocols.fics.homing import (
    GetHomingOffsets,
    GetHomingSpeeds,
    GetHomingTypes,
    GetIndexSearchSpeeds,
    SetHomingOffsets,
    SetHomingSpeeds,
    SetHomingTypes,
    SetIndexSearchSpeeds,
)
from protocols.fics.motor_axes import (
    GetMotorAccelerationTimes,
    GetMotorDecelerationTimes,
    GetMotorLowerSoftLimits,
    GetMotorMaximumSpeeds,
    GetMotorSpeedPercent,
    GetMotorUpperSoftLimits,
    SetMotorAccelerationTimes,
    SetMotorDecelerationTimes,
    SetMotorLowerSoftLimits,
    SetMotorMaximumSpeeds,
    SetMotorSpeedPercent,
    SetMotorUpperSoftLimits,
)
from protocols.fics.row import FicsCommand, Query
from protocols.fics.soft_limits import (
    GetLowerSoftLimits,
    GetUpperSoftLimits,
    SetLowerSoftLimits,
    SetUpperSoftLimits,
)
from protocols.fics.speeds import (
    GetAccelerationTimes,
    GetDecelerationTimes,
    GetMaximumSpeeds,
    GetSelfStartSpeeds,
    GetSmoothAcceleration,
    GetSpeedPercent,
    SetAccelerationTimes,
    SetDecelerationTimes,
    SetMaximumSpeeds,
    SetSelfStartSpeeds,
    SetSmoothAcceleration,
    SetSpeedPercent,
    SmoothAcceleration,
)
from protocols.table import Reply
from simulator.fics.actions import Code, Refused, acts_out
from simulator.fics.axes import Axis
from simulator.fics.robot import Robot
from simulator.fics.units import Unit

Getter = type[Query[Any]]
Setter = type[FicsCommand[Any]]


def _users(unit: Unit) -> Sequence[Axis]:
    return unit.users


def _motors(unit: Unit) -> Sequence[Axis]:
    return unit.motors


def _anything(_axis: Axis, _value: float) -> bool:
    return True


def _above_minus(axis: Axis, value: float) -> bool:
    return value >= axis.minus_limit


def _below_plus(axis: Axis, value: float) -> bool:
    return value <= axis.plus_limit


def _setting(
    getter: Getter,
    setter: Setter,
    axes_of: Callable[[Unit], Sequence[Axis]],
    attribute: str,
    allowed: Callable[[Axis, float], bool] = _anything,
) -> None:
    """Act out a setting of axes and its query. An axis that is user and motor axis has one value for both."""
    (field,) = setter.model_fields

    def tell(robot: Robot, command: FicsCommand[Any], now: float) -> Reply:
        values = [getattr(axis, attribute) for axis in axes_of(robot.unit)]
        return getter.reply_type().model_validate({field: values})

    def change(robot: Robot, command: FicsCommand[Any], now: float) -> None:
        values, axes = getattr(command, field), axes_of(robot.unit)
        if len(values) > len(axes):
            raise Refused(Code.FORMAT)
        given = [(axis, value) for axis, value in zip(axes, values, strict=False) if value is not None]
        if not all(allowed(axis, value) for axis, value in given):
            raise Refused(Code.RANGE)
        for axis, value in given:
            setattr(axis, attribute, value)

    acts_out(getter)(tell)
    acts_out(setter)(change)


_setting(GetSpeedPercent, SetSpeedPercent, _users, "percent")
_setting(GetMaximumSpeeds, SetMaximumSpeeds, _users, "top_speed")
_setting(GetAccelerationTimes, SetAccelerationTimes, _users, "acceleration_ms")
_setting(GetDecelerationTimes, SetDecelerationTimes, _users, "deceleration_ms")
_setting(GetUpperSoftLimits, SetUpperSoftLimits, _users, "plus_limit", _above_minus)
_setting(GetLowerSoftLimits, SetLowerSoftLimits, _users, "minus_limit", _below_plus)

_setting(GetMotorSpeedPercent, SetMotorSpeedPercent, _motors, "motor_percent")
_setting(GetMotorMaximumSpeeds, SetMotorMaximumSpeeds, _motors, "top_speed")
_setting(GetMotorAccelerationTimes, SetMotorAccelerationTimes, _motors, "acceleration_ms")
_setting(GetMotorDecelerationTimes, SetMotorDecelerationTimes, _motors, "deceleration_ms")
_setting(GetMotorUpperSoftLimits, SetMotorUpperSoftLimits, _motors, "plus_limit", _above_minus)
_setting(GetMotorLowerSoftLimits, SetMotorLowerSoftLimits, _motors, "minus_limit", _below_plus)

_setting(GetSelfStartSpeeds, SetSelfStartSpeeds, _motors, "start_speed_pps")
_setting(GetHomingTypes, SetHomingTypes, _motors, "homing_type")
_setting(GetHomingOffsets, SetHomingOffsets, _motors, "homing_offset")
_setting(GetHomingSpeeds, SetHomingSpeeds, _motors, "homing_speed")
_setting(GetIndexSearchSpeeds, SetIndexSearchSpeeds, _motors, "z_speed")


@acts_out(GetSmoothAcceleration)
def _get_s_curve(robot: Robot, command: GetSmoothAcceleration, now: float) -> SmoothAcceleration:
    return SmoothAcceleration(enabled=1 if robot.unit.s_curve else 0)


@acts_out(SetSmoothAcceleration)
def _set_s_curve(robot: Robot, command: SetSmoothAcceleration, now: float) -> None:
    robot.unit.s_curve = bool(command.enabled)
