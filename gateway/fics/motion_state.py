"""The motion of a robot as far as is known, and the reasons why the next motion must not begin."""

import asyncio
from collections.abc import Sequence
from typing import Any, Final

from gateway.fics.axes import Tell, UnitAxes
from gateway.fics.errors import RobotBusy
from protocols.fics.axis_settings import AxisTimes
from protocols.fics.homing import HomeRobot
from protocols.fics.jog import StartJog
from protocols.fics.macros import RunMacro
from protocols.fics.motor_axes import GetMotorDecelerationTimes
from protocols.fics.row import Block, FicsCommand
from protocols.fics.speeds import GetDecelerationTimes

MOVES_ALL_UNITS = HomeRobot, RunMacro
SMOOTH = 2.0
"""Duration of an S-curve as a multiple of that of a straight ramp, at most: an assumption."""
QUESTIONS: Final[Sequence[FicsCommand[AxisTimes]]] = (GetDecelerationTimes(), GetMotorDecelerationTimes())
_CODES: Final = frozenset(question.code for question in QUESTIONS)
"""The codes of the questions, and of the commands that set the times."""


class Ramps:
    """The deceleration times of a robot as told last: in motion it tells none (C-HOST manual 1-7)."""

    def __init__(self) -> None:
        self._times_ms: dict[tuple[int, str], Sequence[float]] = {}
        """Deceleration times in milliseconds, by unit and command."""

    @property
    def longest_s(self) -> float | None:
        """The seconds that a decelerating stop may take; None where the robot has told nothing."""
        times_ms = [time for times in self._times_ms.values() for time in times]
        return SMOOTH * max(times_ms) / 1000 if times_ms else None

    def unknown_of(self, unit: UnitAxes) -> list[FicsCommand[AxisTimes]]:
        """The questions that a unit has not answered yet."""
        return [question for question in QUESTIONS if (unit.number, question.code) not in self._times_ms]

    def note(self, unit: UnitAxes, command: FicsCommand[Any], reply: AxisTimes) -> None:
        """Note the times that a unit has told to any question."""
        if command.code in _CODES:
            self._times_ms[unit.number, command.code] = reply.times_ms

    def forget(self) -> None:
        """Believe them no more: settings that were not stored are lost with the power."""
        self._times_ms.clear()


class MotionState:
    """The motion of one robot, as far as is known."""

    def __init__(self, robot_id: str, tell: Tell) -> None:
        self._robot_id = robot_id
        self._tell = tell
        self.command: FicsCommand[Any] | None = None
        """The motion command of ours that is under way."""
        self.unit: int | None = None
        """The unit the last one was sent to."""
        self.kept: int | None = None
        """The unit that moves: no other can be selected, but a macro may (C-HOST manual 1-7)."""
        self.foreign: bool | None = None
        """True if it was seen to move without a command of ours; None until it was looked at."""
        self.poll_due = asyncio.Event()
        """Set when it is to be looked at now, not at the next round."""
        self.idle = asyncio.Event()
        """No unit has a move that is not over."""
        self.idle.set()
        self.still: set[int] = set()
        """The units that stood still when last asked; nothing was sent since that could move them."""
        self.tables_change = asyncio.Lock()
        """Held from a change of a table of positions until it is read back: nothing moves meanwhile."""
        self.ramps = Ramps()
        self.stops = 0
        """Count of the stops that are not confirmed yet, or not recorded."""

    @property
    def moving(self) -> bool | None:
        """True if it moves; None where it was not looked at since it was out of reach."""
        return True if self.command is not None else self.foreign

    @property
    def stopping(self) -> bool:
        """True if a stop is not confirmed yet."""
        return self.stops > 0

    @property
    def jogs(self) -> bool:
        """True if the motion under way is that of JOG sessions."""
        return isinstance(self.command, StartJog)

    # motion commands

    def begin(self, command: FicsCommand[Any], unit: int) -> None:
        """A motion command has been written."""
        self.command, self.unit = command, unit
        self.kept = None if isinstance(command, RunMacro) else unit
        if isinstance(command, MOVES_ALL_UNITS):
            self.still.clear()
        self.still.discard(unit)

    def end(self, *, refused: bool = False) -> None:
        """The motion command is over; one that was `refused` has moved nothing."""
        self.command = self.kept = None
        if self.unit is None or refused:
            return
        self.foreign = False if self.unit in self.still else None
        if self.foreign is None:
            self.poll_soon()

    # what was seen

    def note_rest(self, unit: int, *, still: bool) -> None:
        """A unit has told whether it stands still."""
        (self.still.add if still else self.still.discard)(unit)

    def note_foreign(self, *, moves: bool | None) -> None:
        """The robot was looked at while no command of ours was under way."""
        was_known, self.foreign = self.foreign, moves
        if moves and not was_known:
            self._tell("robot.motion.foreign", {})

    def doubt(self) -> None:
        """Forget that it stands still."""
        self.foreign = self.foreign or None
        self.poll_soon()

    def poll_soon(self) -> None:
        """Look at it now, not at the next round."""
        self.poll_due.set()

    # stops

    def confirm_stop(self) -> None:
        """All units were seen to stand still."""
        self.foreign = False

    # what is refused meanwhile

    def require_still(self, command: FicsCommand[Any]) -> None:
        """Refuse a motion command while something else goes on.

        :raises RobotBusy: something moves, a stop is not confirmed, or positions are being changed.
        """
        if self.stopping:
            raise RobotBusy(
                f"The stop of {self._robot_id} is not confirmed yet; {command.wire_name()} was not sent.",
                "Wait for standstill.",
            )
        if self.tables_change.locked():
            raise RobotBusy(
                f"Positions of {self._robot_id} are being changed and read back; {command.wire_name()} was "
                "not sent.",
                "Try again.",
            )
        self.require_free(command)

    def require_free(self, command: FicsCommand[Any]) -> None:
        """Refuse what the manual forbids during motion (C-HOST manual 1-7), as Ver.2 would do silently.

        :raises RobotBusy: a motion command is under way.
        """
        if self.command is None or Block.MOTION not in command.blocked:
            return
        if not (self.jogs and isinstance(command, StartJog)):
            raise RobotBusy(
                f"{self.command.wire_name()} of {self._robot_id} is under way; {command.wire_name()} was not "
                "sent.",
                "Wait for its end or stop it.",
            )
