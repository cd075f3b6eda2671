"""Where a move should end, and what positions prove of its end, once its axes stand still. Nothing is asked.

A move is done where its axes stand at a target that is known. Where none is, it is done only if it was seen
to run, ended without an error, and the power was never lost. An answer alone proves nothing: it may be a
copy of that to an earlier command.
"""

from dataclasses import dataclass
from typing import Any

from gateway.core.verdicts import Begun, Place
from gateway.fics.axes import DISPLAYED, NOISE_DIGITS, Places, UnitAxes
from protocols.fics.homing import HomeRobot
from protocols.fics.jog import StepAxis
from protocols.fics.motor_axes import MoveMotorsAbsolute, MoveMotorsRelative
from protocols.fics.moves import AxesMove, MoveAbsolute, MoveRelative, MoveToPosition
from protocols.fics.notation import AxisSystem
from protocols.fics.row import FicsCommand

TOLERANCE = 2 * DISPLAYED
"""A successful move may end so far from its target: its start and its end were both rounded for display."""


def axes_it_needs(unit: UnitAxes, command: FicsCommand[Any], target: Places | None) -> list[str]:
    """The axes whose positions have to be known before a move.

    A place can only be gone to from a known one (C-HOST manual 2-6, 2-16, 4-3); a stored position whose
    `target` is not known may be one of all axes. Relative moves go unhomed (2-5, 4-2), and so do steps, but
    not those of a converted axis (2-3).
    """
    if isinstance(command, StepAxis):
        return [command.axis] if unit.converted(command.axis) else []
    if isinstance(command, MoveAbsolute | MoveMotorsAbsolute | MoveToPosition):
        return unit.axes if target is None else list(target)
    return []


def places_it_needs(
    unit: UnitAxes, command: FicsCommand[Any], start: Places, target: Places | None
) -> Places:
    """The places that have to be known before a move, as far as they are."""
    return {name: start[name] for name in axes_it_needs(unit, command, target)}


def target_of(
    unit: UnitAxes, command: FicsCommand[Any], start: Places, stored: list[float | None] | None = None
) -> dict[str, float | None] | None:
    """Where the axes should come to, by name; null for one that moves from an unknown place.

    `stored` is the position a move goes to by its number. None where it cannot be known beforehand.
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

    None where it cannot be known beforehand.
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
    """True if an axis is known to stand off its target, wherever the others do."""
    return any(
        (furthest_miss({axis: place}, position) or 0.0) > TOLERANCE for axis, place in (target or {}).items()
    )


def furthest_miss(target: Places | None, position: Places | None) -> float | None:
    """The distance of the worst axis from its target; None where that is not known of all of them."""
    if not target or position is None:
        return None
    misses = []
    for axis, wanted in target.items():
        found = position.get(axis)
        if wanted is None or found is None:
            return None
        misses.append(round(abs(wanted - found), NOISE_DIGITS))
    return max(misses)


@dataclass(frozen=True, slots=True)
class PlaceProof:
    """The facts about a move without an error whose axes stand still."""

    command: FicsCommand[Any]
    start: Places
    """An axis is None while its place is not known, here as everywhere."""
    target: Places | None
    """The targets of the axes that were to move; None where they cannot be known beforehand."""
    position: Places | None
    """Places at standstill; None where they were not read."""
    moved: bool
    """True if the axes moved when they were asked."""
    replied: bool
    """True if the robot has answered its end."""

    def ran(self) -> bool:
        """True if the axes were seen to move, or one stands where it did not.

        One that no longer knows its place tells nothing: that may be a loss of power.
        """
        now = (self.position or {}).items()
        return self.moved or any(place is not None and place != self.start.get(axis) for axis, place in now)

    def begun(self) -> Begun:
        """How it is known that the command was executed."""
        return Begun.SEEN if self.ran() else Begun.ANSWERED if self.replied else Begun.UNREFUSED

    def place(self) -> Place:
        """Where the axes stand, if that is known; roundings hide a very short way."""
        if is_missed(self.target, self.position):
            return Place.ELSEWHERE if self.ran() else Place.START
        miss = furthest_miss(self.target, self.position)
        if miss is None or miss > TOLERANCE:
            return Place.UNKNOWN
        return Place.TARGET if miss == 0 or self.replied or self.ran() else Place.TARGET_PERHAPS

    def stayed(self) -> bool:
        """True if a move to a known place has not left its own, perhaps because both are one."""
        return not self.ran() and self.place() is not Place.UNKNOWN

    def ran_its_course(self) -> bool:
        """True if it is done if the power was kept: it ran, and lacks nothing that its end should show."""
        return self.ran() and (self.replied or not self._lacks_its_end())

    def _lacks_its_end(self) -> bool:
        """True if a known target was not seen to be reached, or homing has left an axis without place."""
        if isinstance(self.command, HomeRobot):
            return not self._is_homed()
        return bool(self.target) and None not in (self.target or {}).values()

    def shows_power(self) -> bool:
        """True if places prove that the power was kept: it takes all of them away (C-HOST manual 2-9)."""
        if isinstance(self.command, HomeRobot):
            return self._is_homed()
        now = self.position or {}
        return any(place is not None and now.get(axis) is not None for axis, place in self.start.items())

    def _is_homed(self) -> bool:
        return bool(self.position) and None not in (self.position or {}).values()
