"""Which units are homed, as their positions tell: a loss of power makes all of them unknown."""

from collections.abc import Callable
from enum import IntEnum
from typing import Any

from gateway.fics.axes import UnitAxes
from protocols.fics.motor_axes import GetMotorPosition
from protocols.fics.row import FicsCommand
from protocols.fics.status import AxisCoordinates, AxisStatuses, MotionMode
from protocols.table import Reply

HIDE_PLACES = (MotionMode.HOMING, MotionMode.MACRO)
"""While these go on, a robot may tell no positions, and may forget them (C-HOST manual 2-9)."""


class OriginSign(IntEnum):
    """What a unit that was homed has told since, in turn."""

    PLACES = 0
    NO_PLACES = 1
    """None of its motors knows its place."""
    NOTHING_HIDES_THEM = 2
    """Nor does anything go on that would hide it."""
    LOST = 3
    """None knows it even so."""


class Origins:
    """The units that are known to be homed."""

    def __init__(self, on_lost: Callable[[], None]) -> None:
        self._on_lost = on_lost
        """Called when a unit is not homed any more, and nothing but a loss of power can have done that."""
        self._signs: dict[int, OriginSign] = {}
        self._all_placed: set[int] = set()
        """The units of which every axis has told its place last."""
        self._busy: set[int] = set()
        """The units in which something goes on that may take places away."""

    def forget(self) -> None:
        """Something begins that may home the robot, or all is lost."""
        self._signs.clear()
        self._all_placed.clear()

    def are_known(self, unit: UnitAxes) -> bool:
        """Whether a unit is known to have something that a loss of power takes away."""
        return unit.number in self._signs

    def are_complete(self, unit: UnitAxes) -> bool:
        """Whether every axis of a unit is known to be homed."""
        return unit.number in self._all_placed

    def are_doubtful(self, unit: UnitAxes) -> bool:
        """Whether a homed unit has just told no place."""
        return self._signs.get(unit.number, OriginSign.PLACES) is not OriginSign.PLACES

    def note(self, unit: UnitAxes, command: FicsCommand[Any], reply: Reply) -> None:
        """Learn from what a unit has told.

        User axes may have no place for want of a conversion: that tells nothing.
        """
        if isinstance(reply, AxisStatuses):
            self._note_busy(unit.number, busy=any(it.motion_mode in HIDE_PLACES for it in reply.axes))
        elif isinstance(reply, AxisCoordinates) and unit.number not in self._busy:
            placed = None not in reply.coordinates
            (self._all_placed.add if placed else self._all_placed.discard)(unit.number)
            if any(place is not None for place in reply.coordinates):
                self._signs[unit.number] = OriginSign.PLACES
            elif isinstance(command, GetMotorPosition) and unit.number in self._signs:
                hidden = self._signs[unit.number] in (OriginSign.PLACES, OriginSign.NO_PLACES)
                self._signs[unit.number] = OriginSign.NO_PLACES if hidden else OriginSign.LOST
                if not hidden:
                    self._on_lost()

    def _note_busy(self, number: int, *, busy: bool) -> None:
        (self._busy.add if busy else self._busy.discard)(number)
        if busy:
            self._signs.pop(number, None)
            self._all_placed.discard(number)
        elif self._signs.get(number) is OriginSign.NO_PLACES:
            self._signs[number] = OriginSign.NOTHING_HIDES_THEM
