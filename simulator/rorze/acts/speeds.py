"""The speed parameters S[n]: commands O with the letter O (RC-420 manual 13.3, 14)."""

from collections.abc import Callable

from protocols.rorze.profile import ProfileError, SpeedParameters
from protocols.rorze.speeds import (
    AccelerationReply,
    GetFallingAccelerationShare,
    GetMaximumAcceleration,
    GetMaximumSpeed,
    GetRisingAccelerationShare,
    GetStartSpeed,
    PercentReply,
    SetFallingAccelerationShare,
    SetMaximumAcceleration,
    SetMaximumSpeed,
    SetRisingAccelerationShare,
    SetStartSpeed,
    SpeedReply,
)
from simulator.rorze.actions import Refused, acts_out
from simulator.rorze.controller import Rc420
from simulator.rorze.settings import STANDARD, SpeedSet

NEVER_SET = 0
"""An assumption: what is answered for a speed parameter that was never set."""

NOT_SET = 0x40
"""The error for OL never set; those for OH, OS, OA and OB follow it."""


def parameters_of(axis: Rc420, number: int) -> SpeedParameters:
    """A set as moves use it.

    :raises Refused: 40-44 where a value was never set, 45 or 46 where the values do not go together.
    """
    chosen = axis.settings.speeds[number]
    low, high = _known(chosen.low, 0), _known(chosen.high, 1)
    acceleration = _known(chosen.acceleration, 2)
    rising, falling = _known(chosen.rising, 3), _known(chosen.falling, 4)
    try:
        return SpeedParameters(low, high, acceleration, rising, falling)
    except ProfileError as error:
        raise Refused(error.code) from None


def start_speed_of(axis: Rc420, number: int) -> int:
    """OL of a set, whatever the rest of it.

    :raises Refused: 40 where it was never set.
    """
    return _known(axis.settings.speeds[number].low, 0)


def _known(value: int | None, place: int) -> int:
    if value is None:
        raise Refused(NOT_SET + place)
    return value


def _value(axis: Rc420, speed_set: int | None, pick: Callable[[SpeedSet], int | None]) -> int:
    value = pick(axis.settings.speeds[_number(speed_set)])
    return NEVER_SET if value is None else value


def _number(speed_set: int | None) -> int:
    return STANDARD if speed_set is None else speed_set


@acts_out(GetStartSpeed)
def _get_start_speed(axis: Rc420, command: GetStartSpeed, _now: float) -> SpeedReply:
    return SpeedReply(speed=_value(axis, command.speed_set, lambda chosen: chosen.low))


@acts_out(SetStartSpeed)
def _set_start_speed(axis: Rc420, command: SetStartSpeed, _now: float) -> None:
    axis.settings = axis.settings.with_speed(_number(command.speed_set), low=command.speed)


@acts_out(GetMaximumSpeed)
def _get_maximum_speed(axis: Rc420, command: GetMaximumSpeed, _now: float) -> SpeedReply:
    return SpeedReply(speed=_value(axis, command.speed_set, lambda chosen: chosen.high))


@acts_out(SetMaximumSpeed)
def _set_maximum_speed(axis: Rc420, command: SetMaximumSpeed, _now: float) -> None:
    axis.settings = axis.settings.with_speed(_number(command.speed_set), high=command.speed)


@acts_out(GetMaximumAcceleration)
def _get_maximum_acceleration(axis: Rc420, command: GetMaximumAcceleration, _now: float) -> AccelerationReply:
    return AccelerationReply(acceleration=_value(axis, command.speed_set, lambda chosen: chosen.acceleration))


@acts_out(SetMaximumAcceleration)
def _set_maximum_acceleration(axis: Rc420, command: SetMaximumAcceleration, _now: float) -> None:
    axis.settings = axis.settings.with_speed(_number(command.speed_set), acceleration=command.acceleration)


@acts_out(GetRisingAccelerationShare)
def _get_rising_share(axis: Rc420, command: GetRisingAccelerationShare, _now: float) -> PercentReply:
    return PercentReply(percent=_value(axis, command.speed_set, lambda chosen: chosen.rising))


@acts_out(SetRisingAccelerationShare)
def _set_rising_share(axis: Rc420, command: SetRisingAccelerationShare, _now: float) -> None:
    axis.settings = axis.settings.with_speed(_number(command.speed_set), rising=command.percent)


@acts_out(GetFallingAccelerationShare)
def _get_falling_share(axis: Rc420, command: GetFallingAccelerationShare, _now: float) -> PercentReply:
    return PercentReply(percent=_value(axis, command.speed_set, lambda chosen: chosen.falling))


@acts_out(SetFallingAccelerationShare)
def _set_falling_share(axis: Rc420, command: SetFallingAccelerationShare, _now: float) -> None:
    axis.settings = axis.settings.with_speed(_number(command.speed_set), falling=command.percent)
