"""Which unit a robot acts on: its answers do not tell, so it is set, and seen, before what depends on it."""

import asyncio
from dataclasses import dataclass

from gateway.core.errors import ControllerRefused, GatewayError, NoReply, PowerCycled
from gateway.fics.commander import Commander
from gateway.fics.errors import RobotBusy, UnitNotSelected
from gateway.fics.motion_state import MotionState, Tell
from gateway.fics.power import Power
from gateway.fics.questions import UNIT
from protocols.fics.link import Refusal
from protocols.fics.system import SelectUnit, UnitNumbers

UNIT_HOLDS_S = 0.5
"""A question trusts the unit the robot has told for this time: an assumption, a loss of power is longer."""
UNIT_OF_POWER_ON = 1
"""An assumption; a robot that is configured with this unit alone never acts on another."""


@dataclass(eq=False)
class Selection:
    """The unit that a robot is known to act on (C-HOST manual 2-1)."""

    _units: int
    """How many there are."""
    _commander: Commander
    _motion: MotionState
    _power: Power
    _tell: Tell
    unit: int | None = None
    """None while it is not certain."""
    _holds_until: float = 0.0

    def __post_init__(self) -> None:
        self._robot_id = self._commander.robot_id

    def forget(self) -> None:
        """Anything may be selected now."""
        self.unit = None

    def doubt(self) -> None:
        """Another unit may have been selected, but not while one moves (C-HOST manual 1-7)."""
        self._holds_until = 0.0
        if not self._motion.keeps_unit:
            self.forget()

    def trust(self) -> None:
        """The robot has told its unit, or will not tell it."""
        self._holds_until = asyncio.get_running_loop().time() + UNIT_HOLDS_S

    def is_trusted(self, number: int) -> bool:
        """Whether the robot has told its unit a moment ago, or keeps it: it moves, or has no other."""
        holds = self._motion.foreign or asyncio.get_running_loop().time() < self._holds_until
        return (self.unit is not None and holds) or self._only(number)

    def holds(self, number: int) -> bool:
        """Whether a question can be put to this unit as things are."""
        known = self.unit == number or self._only(number)
        return known and (self._motion.command is not None or self.is_trusted(number))

    async def make(self, number: int, *, afresh: bool) -> None:
        """Make sure that a unit is selected; `afresh` asks the robot even where the gateway knows.

        A robot that moves is asked, too, where nobody knows its unit, as after a restart in the middle of a
        move: it refuses that until the unit it acts on stands still (C-HOST manual 1-7).

        :raises RobotBusy: the robot moves, and while it does no other unit can be selected.
        :raises UnitNotSelected: the robot did not answer, or acts on another unit nevertheless.
        :raises ControllerRefused: the teaching terminal keeps the robot from it.
        """
        known = self.unit == number or self._only(number)
        if known and (self._motion.command is not None or not afresh):
            return
        kept = self._motion.unit if self._motion.keeps_unit else None
        before = self.unit
        if before is not None:
            self._require_free(number, kept)
        found = await self._found() if afresh else None
        if found is not None and before is not None and found != before:
            self._tell("robot.unit.changed", {"expected": before, "found": found})
        if found != number:
            self._require_free(number, kept)
            await self._change_to(number)
            found = await self._found()
        if found != number:
            raise UnitNotSelected(
                f"Robot {self._robot_id} acts on unit {found}, not on unit {number}; nothing more was sent.",
                "See who else selects units, then try again.",
            )
        self.unit = number
        self.trust()

    def _require_free(self, number: int, kept: int | None) -> None:
        """Refuse to select another unit than the one that is `kept`, for it moves."""
        if kept not in (None, number):
            raise RobotBusy(
                f"Robot {self._robot_id} moves, so unit {number} cannot be selected; nothing was sent.",
                "Wait for standstill.",
            )

    def _only(self, number: int) -> bool:
        """Whether nothing else can be selected."""
        return number == UNIT_OF_POWER_ON and self._units == 1

    async def _found(self) -> int:
        """The unit the robot says it acts on; what it was believed to be no longer counts."""
        self.unit, before = None, self.unit
        unanswered = UnitNotSelected(
            f"Robot {self._robot_id} did not answer UNT, so nobody knows which unit it acts on; nothing more "
            "was sent.",
            "Try again.",
        )
        try:
            reply = await self._commander.prepare(UNIT, unanswered, fresh=True)
        except ControllerRefused:
            self.unit = before
            raise
        self.unit = reply.host_unit if isinstance(reply, UnitNumbers) else None
        return self.unit or 0

    async def _change_to(self, number: int) -> None:
        """Select a unit; whether that has worked is seen afterwards, answered or not."""
        command = SelectUnit(unit=number)
        self.unit, before = None, self.unit
        outcome = await self._commander.say(command)
        if isinstance(outcome, Refusal):
            self.unit = before
        if isinstance(outcome, NoReply):
            await self._blame_power()
        else:
            self._commander.answered(command, outcome)

    async def _blame_power(self) -> None:
        """Silence may be that of Ver.2, the mode of power-on.

        :raises PowerCycled: it is.
        """
        try:
            await self._power.see()
        except PowerCycled:
            raise
        except GatewayError:
            return  # it is simply silent
