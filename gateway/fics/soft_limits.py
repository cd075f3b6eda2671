"""Soft limits: changes that a robot will take, for those of an axis never cross, and moves beyond (2-33)."""

from collections.abc import Mapping
from typing import Any, Final, Literal, NamedTuple

from gateway.core.errors import ControllerRefused, GatewayError, InvalidRequest
from gateway.fics.axes import NOISE_DIGITS, Coordinates, Places
from gateway.fics.units import RobotUnit
from gateway.texts import Text, text
from protocols.fics.axis_settings import CoordinateSetting
from protocols.fics.motor_axes import (
    GetMotorLowerSoftLimits,
    GetMotorUpperSoftLimits,
    SetMotorLowerSoftLimits,
    SetMotorUpperSoftLimits,
)
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


class CrossedAxisLimit(NamedTuple):
    """A soft limit of an axis that a place lies beyond, in the unit of the axis."""

    axis: str
    side: Literal["upper", "lower"]
    limit: float
    place: float
    unit: str

    @property
    def said(self) -> Text:
        """Say so: in English as a clause, in Japanese as a sentence."""
        place, limit = self._shown(self.place), self._shown(self.limit)
        return text(f"phrases.axis-beyond-{self.side}", axis=self.axis, place=place, limit=limit)

    def _shown(self, place: float) -> str:
        return f"{round(place, NOISE_DIGITS):.15g} {self.unit}"


async def crossed_limits(unit: RobotUnit, coordinates: Coordinates, end: Places) -> list[CrossedAxisLimit]:
    """Give the soft limits that the end of a move lies beyond; such a move is refused (C-HOST manual 2-12).

    An axis whose place is not known has none: a robot cannot hold it to them either, an assumption.

    :raises GatewayError: the limits were not read.
    """
    ends = {axis: round(place, NOISE_DIGITS) for axis, place in end.items() if place is not None}
    if not ends:
        return []
    limits = next(it for it in _LIMITS if it.coordinates == coordinates)
    lower, upper = [await _read(unit, limits, row) for row in (limits.get_lower, limits.get_upper)]
    units = unit.counted_in(coordinates)
    above = [
        CrossedAxisLimit(it, "upper", upper[it], at, units[it]) for it, at in ends.items() if at > upper[it]
    ]
    below = [
        CrossedAxisLimit(it, "lower", lower[it], at, units[it]) for it, at in ends.items() if at < lower[it]
    ]
    return sorted(above + below, key=lambda it: list(ends).index(it.axis))


async def name_limits(
    unit: RobotUnit, coordinates: Coordinates, end: Places | None, refusal: GatewayError
) -> None:
    """Name the axes, their targets and the limits, where a refused move leads beyond; only reads are sent."""
    if not isinstance(refusal, ControllerRefused) or refusal.error_code != BEYOND or not end:
        return
    try:
        crossed = await crossed_limits(unit, coordinates, end)
    except GatewayError:
        return  # the refusal stands, with the manual's words
    if not crossed:
        return
    said = [it.said for it in crossed]
    beyond = Text(", and ".join(it.en for it in said), "".join(it.ja for it in said))
    refusal.reword("robot.beyond-limits", unit=unit.address, code=refusal.command_code, beyond=beyond)


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
