"""Where a move should end and whether it has: what positions prove of it."""

from typing import Any

from gateway.fics.axes import DISPLAYED, Places, UnitAxes
from gateway.fics.errors import HOME_FIRST, NotHomed, PositionUnknown
from gateway.fics.units import RobotUnit, UnknownReason
from protocols.fics.jog import StepAxis
from protocols.fics.motor_axes import MoveMotorsAbsolute, MoveMotorsRelative
from protocols.fics.moves import AxesMove, MoveAbsolute, MoveRelative, MoveToPosition
from protocols.fics.notation import AxisSystem
from protocols.fics.row import FicsCommand

TOLERANCE = 2 * DISPLAYED
"""A successful move may end so far from its target: its start and its end were both rounded for display."""
NOISE_DIGITS = 6
"""Decimals behind these are those of binary numbers, not of places."""

_WHY: dict[UnknownReason, str] = {
    "not_homed": "it is not homed",
    "homing": "the robot is homing",
    "macro": "a macro is running",
    "automatic": "the robot is in automatic operation",
    "no_conversion": "its motors stand where no user coordinates exist",
    "not_known": "the robot does not say why",
}


def axes_it_needs(unit: UnitAxes, command: FicsCommand[Any], target: Places | None) -> list[str]:
    """The axes whose positions have to be known before a move.

    A place can only be gone to from a known one (C-HOST manual 2-6, 2-16, 4-3); a stored position whose
    `target` nobody knows may be one of all axes. Relative moves go unhomed (2-5, 4-2), and so do steps, but
    not those of a converted axis (2-3).
    """
    if isinstance(command, StepAxis):
        return [command.axis] if unit.converted(command.axis) else []
    if isinstance(command, MoveAbsolute | MoveMotorsAbsolute | MoveToPosition):
        return unit.axes if target is None else list(target)
    return []


async def require_known(
    unit: RobotUnit, command: FicsCommand[Any], start: Places, target: Places | None
) -> None:
    """Refuse a move that needs a position the robot does not tell.

    :raises NotHomed: an axis is not homed.
    :raises PositionUnknown: it is not known for another reason.
    """
    needed = {name: start[name] for name in axes_it_needs(unit, command, target)}
    await require_places(unit, needed, command)


async def require_places(unit: RobotUnit, places: Places, command: FicsCommand[Any]) -> None:
    """Refuse a command that needs to know where axes stand.

    :raises NotHomed: an axis is not homed.
    :raises PositionUnknown: it is not known for another reason.
    """
    missing: Places = {name: None for name, place in places.items() if place is None}
    if not missing:
        return
    reasons = await unit.why_unknown(missing)
    axis, reason = next(iter(reasons.items()))
    detail = (
        f"The position of axis {axis} of {unit.address} is not known, for {_WHY[reason]}; "
        f"{command.wire_name()} was not sent."
    )
    if reason == "not_homed":
        raise NotHomed(detail, HOME_FIRST)
    raise PositionUnknown(detail, "Read the status of the unit and the errors of the robot.")


def target_of(
    unit: UnitAxes, command: FicsCommand[Any], start: Places, stored: list[float | None] | None = None
) -> dict[str, float | None] | None:
    """Where the axes should come to, by name; null for one that moves from an unknown place.

    `stored` is the position a move goes to by its number. None where nobody can know it beforehand.
    """
    if isinstance(command, MoveToPosition):
        return _named(unit.axes, stored) if stored else None
    if not isinstance(command, AxesMove):
        return None
    target = _named(list(start), command.coordinates)
    if isinstance(command, MoveRelative | MoveMotorsRelative):
        return {name: _sum(start[name], amount) for name, amount in target.items()}
    return target


def end_of(unit: UnitAxes, command: FicsCommand[Any], start: Places, target: Places | None) -> Places | None:
    """Where a move leads: to its target, or as far as a step counts, which proves too little to be a target.

    None where nobody can know it beforehand.
    """
    if not isinstance(command, StepAxis):
        return target
    smallest = 1.0 if unit.systems[command.axis] is AxisSystem.PULSE else DISPLAYED
    return {command.axis: _sum(start.get(command.axis), command.steps * smallest)}


def _named(names: list[str], values: list[float | None]) -> dict[str, float | None]:
    return {name: value for name, value in zip(names, values, strict=False) if value is not None}


def _sum(place: float | None, amount: float | None) -> float | None:
    return None if place is None or amount is None else place + amount


def is_missed(target: Places | None, position: Places | None) -> bool:
    """Whether an axis is known to stand off its target, wherever the others do."""
    return any(
        (furthest_miss({axis: place}, position) or 0.0) > TOLERANCE for axis, place in (target or {}).items()
    )


def furthest_miss(target: Places | None, position: Places | None) -> float | None:
    """How far the worst axis stands from its target; None where that is not known of all of them."""
    if not target or position is None:
        return None
    misses = []
    for axis, wanted in target.items():
        found = position.get(axis)
        if wanted is None or found is None:
            return None
        misses.append(round(abs(wanted - found), NOISE_DIGITS))
    return max(misses)
