"""Which unit a robot acts on: its answers do not tell, so it is set, and seen, before what depends on it."""

import asyncio
from typing import TYPE_CHECKING

from gateway.core.errors import ControllerRefused, GatewayError, NoReply
from gateway.fics.errors import PowerCycled, RobotBusy, UnitNotSelected
from protocols.fics.link import Refusal
from protocols.fics.macros import RunMacro
from protocols.fics.system import GetUnit, SelectUnit, UnitNumbers

if TYPE_CHECKING:
    from gateway.fics.robot import Robot


UNIT_HOLDS_S = 0.5
"""For so long a question trusts the unit the robot has told: an assumption, no loss of power is shorter."""
UNIT_OF_POWER_ON = 1
"""An assumption; a robot that is configured with this unit alone never acts on another."""


class Selection:
    """The unit that a robot is known to act on (C-HOST manual 2-1)."""

    def __init__(self, robot: "Robot") -> None:
        self._robot = robot
        self.unit: int | None = None
        """None while it is not certain."""
        self._holds_until = 0.0

    def forget(self) -> None:
        """Anything may be selected now."""
        self.unit = None

    def doubt(self) -> None:
        """Somebody may have selected another unit, but not while one moves (C-HOST manual 1-7)."""
        self._holds_until = 0.0
        if self._robot.motion is None or isinstance(self._robot.motion, RunMacro):
            self.forget()

    def trust(self) -> None:
        """The robot has told its unit, or will not tell it."""
        self._holds_until = asyncio.get_running_loop().time() + UNIT_HOLDS_S

    def is_trusted(self) -> bool:
        """Whether the robot has told its unit a moment ago, or keeps it, for something moves."""
        holds = asyncio.get_running_loop().time() < self._holds_until
        return self.unit is not None and (holds or bool(self._robot.moves_by_itself))

    async def make(self, number: int, *, afresh: bool) -> None:
        """Make sure that a unit is selected; `afresh` asks the robot even where the gateway knows.

        :raises RobotBusy: the robot moves, and while it does no other unit can be selected.
        :raises UnitNotSelected: the robot did not answer, or acts on another unit nevertheless.
        :raises ControllerRefused: the teaching terminal keeps the robot from it.
        """
        robot = self._robot
        known = self.unit == number or self.only(number)
        if known and (robot.motion is not None or not afresh):
            return
        if robot.motion is not None and not isinstance(robot.motion, RunMacro):
            raise RobotBusy(
                f"Robot {robot.id} moves, so unit {number} cannot be selected; nothing was sent.",
                "Wait for standstill.",
            )
        before = self.unit
        found = await self._found() if afresh else None
        if found is not None and before is not None and found != before:
            robot.publish("robot.unit.changed", {"expected": before, "found": found})
        if found != number:
            await self._change_to(number)
            found = await self._found()
        if found != number:
            raise UnitNotSelected(
                f"Robot {robot.id} acts on unit {found}, not on unit {number}; nothing more was sent.",
                "See who else selects units, then try again.",
            )
        self.unit = number
        self.trust()

    def only(self, number: int) -> bool:
        """Whether nothing else can be selected."""
        return number == UNIT_OF_POWER_ON and len(self._robot.units) == 1

    async def _found(self) -> int:
        """The unit the robot says it acts on; what it was believed to be no longer counts."""
        robot, query = self._robot, GetUnit()
        self.unit, before = None, self.unit
        unanswered = UnitNotSelected(
            f"Robot {robot.id} did not answer UNT, so nobody knows which unit it acts on; nothing more was "
            "sent.",
            "Try again.",
        )
        try:
            reply = await robot.dialogue.prepare(query, unanswered, fresh=True)
        except ControllerRefused:
            self.unit = before
            raise
        self.unit = reply.host_unit if isinstance(reply, UnitNumbers) else None
        return self.unit or 0

    async def _change_to(self, number: int) -> None:
        """Select a unit; whether that has worked is seen afterwards, answered or not."""
        dialogue, command = self._robot.dialogue, SelectUnit(unit=number)
        self.unit, before = None, self.unit
        outcome = await dialogue.say(command, self._robot.line.stop_epoch)
        if isinstance(outcome, Refusal):
            self.unit = before
        if isinstance(outcome, NoReply):
            await self._blame_power()
        else:
            dialogue.answered(command, outcome)

    async def _blame_power(self) -> None:
        """Silence may be that of Ver.2, the mode of power-on.

        :raises PowerCycled: it is.
        """
        try:
            await self._robot.power.see()
        except PowerCycled:
            raise
        except GatewayError:
            return  # it is simply silent
