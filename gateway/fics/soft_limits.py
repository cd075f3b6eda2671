"""Soft limits: changes that a robot will take, for those of an axis never cross, and moves beyond (2-33)."""

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from gateway.core.errors import ControllerRefused, GatewayError, InvalidRequest
from gateway.fics.axes import Coordinates, Places
from gateway.fics.targets import NOISE_DIGITS
from gateway.fics.units import RobotUnit
from protocols.fics.axis_settings import CoordinateSetting
from protocols.fics.motor_axes import (
    GetMotorLowerSoftLimits,
    GetMotorUpperSoftLimits,
    SetMotorLowerSoftLimits,
    SetMotorUpperSoftLimits,
)
from protocols.fics.notation import Quantity
from protocols.fics.row import FicsCommand
from protocols.fics.soft_limits import (
    GetLowerSoftLimits,
    GetUpperSoftLimits,
    SetLowerSoftLimits,
    SetUpperSoftLimits,
)

Row = type[FicsCommand[Any]]


class _Limits(NamedTuple):
    coordinates: Coordinates
    get_lower: Row
    get_upper: Row
    set_lower: type[CoordinateSetting]
    set_upper: type[CoordinateSetting]


_LIMITS: Final = (
    _Limits("user", GetLowerSoftLimits, GetUpperSoftLimits, SetLowerSoftLimits, SetUpperSoftLimits),
    _Limits(
        "motor",
        GetMotorLowerSoftLimits,
        GetMotorUpperSoftLimits,
        SetMotorLowerSoftLimits,
        SetMotorUpperSoftLimits,
    ),
)


BEYOND: Final = "E07"
"""What a robot answers to a target beyond a soft limit, of whichever axis (C-HOST manual 2-12)."""


async def name_limits(
    unit: RobotUnit, coordinates: Coordinates, target: Places | None, refusal: GatewayError
) -> None:
    """Name the axes, their targets and the limits, where a refused move leads beyond; only reads are sent."""
    if not isinstance(refusal, ControllerRefused) or refusal.error_code != BEYOND or not target:
        return
    limits = next(it for it in _LIMITS if it.coordinates == coordinates)
    try:
        lower, upper = [await _read(unit, limits, row) for row in (limits.get_lower, limits.get_upper)]
    except GatewayError:
        return  # the refusal stands, with the manual's words
    beyond = [
        (axis, place, *(("upper", "+", upper[axis]) if place > upper[axis] else ("lower", "-", lower[axis])))
        for axis, place in target.items()
        if place is not None and not lower[axis] <= round(place, NOISE_DIGITS) <= upper[axis]
    ]
    if not beyond:
        return

    def shown(axis: str, place: float) -> str:
        return f"{round(place, NOISE_DIGITS):.15g} {unit.systems[axis].unit(Quantity.POSITION)}"

    code = refusal.command_code
    told = [
        f"the target {shown(axis, place)} of axis {axis} lies beyond its {side} soft limit "
        f"{shown(axis, limit)}"
        for axis, place, side, _, limit in beyond
    ]
    told_ja = [
        f"{axis}軸の移動先 {shown(axis, place)} が{sign}ソフトリミット {shown(axis, limit)} を超えています。"
        for axis, place, _, sign, limit in beyond
    ]
    refusal.detail = f"{unit.address} refused {code}: {', and '.join(told)}. Nothing moved because of it."
    refusal.remedy = "Choose a target within the soft limits, or change them in the unit's settings."
    refusal.detail_ja = f"{unit.address} {code}: {''.join(told_ja)}このコマンドではモータは動いていません。"
    refusal.remedy_ja = "ソフトリミットの範囲内の移動先を指定するか、ソフトリミットの設定を変更してください。"


async def uncrossed(unit: RobotUnit, changes: Mapping[str, FicsCommand[Any]]) -> list[FicsCommand[Any]]:
    """Put changes, given with their fields, into an order in which no limits cross on the way.

    :raises InvalidRequest: in the end an upper limit would be below the lower one.
    :raises GatewayError: the present limits could not be read.
    """
    ordered = list(changes.values())
    for limits in _LIMITS:
        concerned = {
            field: change
            for field, change in changes.items()
            if isinstance(change, limits.set_lower | limits.set_upper)
        }
        if concerned:
            ordered = [change for change in ordered if change not in concerned.values()]
            ordered += await _sequence(unit, limits, concerned)
    return ordered


async def _sequence(
    unit: RobotUnit, limits: _Limits, changes: Mapping[str, FicsCommand[Any]]
) -> list[FicsCommand[Any]]:
    """Raise upper limits first, then set the lower ones, then let the other upper ones come down."""
    lower, upper = [await _read(unit, limits, row) for row in (limits.get_lower, limits.get_upper)]
    names = unit.names(limits.coordinates)
    new_lower, new_upper = [_given(names, changes, row) for row in (limits.set_lower, limits.set_upper)]
    for axis in names:
        low, high = (lower | new_lower)[axis], (upper | new_upper)[axis]
        if high < low:
            raise InvalidRequest(
                f"{', '.join(changes)}: axis {axis} of {unit.address} would have soft limits from {low:g} to "
                f"{high:g}; nothing was changed."
            )
    early = {axis: value for axis, value in new_upper.items() if value >= lower[axis]}
    late = {axis: value for axis, value in new_upper.items() if axis not in early}
    steps = ((limits.set_upper, early), (limits.set_lower, new_lower), (limits.set_upper, late))
    return [row(coordinates=[values.get(name) for name in names]) for row, values in steps if values]


async def _read(unit: RobotUnit, limits: _Limits, row: Row) -> dict[str, float]:
    reply = await unit.read(row())
    return unit.by_axis(unit.names(limits.coordinates), reply.coordinates)


def _given(
    names: list[str], changes: Mapping[str, FicsCommand[Any]], row: type[CoordinateSetting]
) -> dict[str, float]:
    coordinates = next((it.coordinates for it in changes.values() if isinstance(it, row)), [])
    named = zip(names, coordinates, strict=False)
    return {axis: value for axis, value in named if value is not None}
