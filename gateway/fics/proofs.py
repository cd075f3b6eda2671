"""What proves how a robot's move has ended, once its axes stand still: pure reasoning, nothing is asked.

A move is done where its axes stand at a target that is known. Where none is, it is done only if it was seen
to run, ended without an error, and the power was never lost. An answer alone proves nothing: it may be a
copy of that to an earlier command.
"""

from dataclasses import dataclass
from typing import Any

from gateway.core.verdicts import Begun, Place
from gateway.fics.axes import Places
from gateway.fics.targets import TOLERANCE, furthest_miss, is_missed
from protocols.fics.homing import HomeRobot
from protocols.fics.row import FicsCommand


@dataclass(frozen=True, slots=True)
class PlaceProof:
    """What is known of a move without an error whose axes stand still."""

    command: FicsCommand[Any]
    start: Places
    """An axis is None while its place is not known, here as everywhere."""
    target: Places | None
    """Of the axes that were to move; None where nobody can know it beforehand."""
    position: Places | None
    """None where it was not read."""
    moved: bool
    """Whether the axes moved when they were asked."""
    replied: bool
    """Whether the robot has answered its end."""

    def ran(self) -> bool:
        """Whether the axes were seen to move, or one stands where it did not.

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
        """Whether a move to a known place has not left its own, perhaps because both are one."""
        return not self.ran() and self.place() is not Place.UNKNOWN

    def ran_its_course(self) -> bool:
        """Whether it is done if the power was kept: it ran, and lacks nothing that its end should show."""
        return self.ran() and (self.replied or not self._lacks_its_end())

    def _lacks_its_end(self) -> bool:
        """Whether a known target was not seen to be reached, or homing has left an axis without place."""
        if isinstance(self.command, HomeRobot):
            return not self._is_homed()
        return bool(self.target) and None not in (self.target or {}).values()

    def shows_power(self) -> bool:
        """Whether places prove that the power was kept: it takes all of them away (C-HOST manual 2-9)."""
        if isinstance(self.command, HomeRobot):
            return self._is_homed()
        now = self.position or {}
        return any(place is not None and now.get(axis) is not None for axis, place in self.start.items())

    def _is_homed(self) -> bool:
        return bool(self.position) and None not in (self.position or {}).values()
