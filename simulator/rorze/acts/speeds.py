"""The speed parameters S[n]: commands O with the letter O (RC-420 manual 13.3, 14)."""

from typing import Any

from protocols.rorze.profile import ProfileError, SpeedParameters
from protocols.rorze.speeds import (
    GetFallingAccelerationShare,
    GetMaximumAcceleration,
    GetMaximumSpeed,
    GetRisingAccelerationShare,
    GetStartSpeed,
    SetFallingAccelerationShare,
    SetMaximumAcceleration,
    SetMaximumSpeed,
    SetRisingAccelerationShare,
    SetStartSpeed,
)
from protocols.table import Reply
from simulator.rorze.actions import Refused, acts_out
from simulator.rorze.acts.kept import Row
from simulator.rorze.controller import Rc420
from simulator.rorze.settings import STANDARD

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
        return SpeedParameters(round(low * axis.pace), round(high * axis.pace), acceleration, rising, falling)
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


def _keeps(getter: Row, setter: Row, parameter: str) -> None:
    """Act out the command that sets a parameter of a speed set, and the one that asks for it."""
    (field,) = setter.model_fields.keys() - {"speed_set"}
    reply = getter.reply_type()

    @acts_out(getter)
    def tell(axis: Rc420, command: Any, _now: float) -> Reply:
        value = getattr(axis.settings.speeds[_number(command.speed_set)], parameter)
        return reply.model_validate({field: NEVER_SET if value is None else value})

    @acts_out(setter)
    def change(axis: Rc420, command: Any, _now: float) -> None:
        value = getattr(command, field)
        axis.settings = axis.settings.with_speed(_number(command.speed_set), **{parameter: value})


def _number(speed_set: int | None) -> int:
    return STANDARD if speed_set is None else speed_set


_keeps(GetStartSpeed, SetStartSpeed, "low")
_keeps(GetMaximumSpeed, SetMaximumSpeed, "high")
_keeps(GetMaximumAcceleration, SetMaximumAcceleration, "acceleration")
_keeps(GetRisingAccelerationShare, SetRisingAccelerationShare, "rising")
_keeps(GetFallingAccelerationShare, SetFallingAccelerationShare, "falling")
