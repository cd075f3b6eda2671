"""What proves how a robot's move has ended, once its axes stand still: pure reasoning, nothing is asked.

A move is done where its axes stand at a target that is known. Where none is, it is done only if it was seen
to run, ended without an error, and the power was never lost. An answer alone proves nothing: it may be a
copy of that to an earlier command.
"""

from dataclasses import dataclass
from typing import Any

from gateway.fics.axes import Places
from gateway.fics.targets import TOLERANCE, furthest_miss, is_missed
from protocols.fics.homing import HomeRobot
from protocols.fics.row import FicsCommand


@dataclass(frozen=True, slots=True)
class Finding:
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

    def off_target(self) -> bool:
        """Whether an axis stands off its target."""
        return is_missed(self.target, self.position)

    def on_target(self) -> bool:
        """Whether all axes stand at their targets."""
        miss = furthest_miss(self.target, self.position)
        return miss is not None and miss <= TOLERANCE

    def stayed(self) -> bool:
        """Whether a move to a known place has not left its own, perhaps because both are one."""
        return not self.ran() and (self.off_target() or self.on_target())

    def untouched(self) -> bool:
        """Whether a move that should have gone somewhere has not left its place."""
        return self.off_target() and self.stayed()

    def arrived(self) -> bool:
        """Whether it is done because of where the axes stand; roundings hide a very short way."""
        there = furthest_miss(self.target, self.position) == 0
        return self.on_target() and (there or self.replied or self.ran())

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
