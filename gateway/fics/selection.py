"""Which unit a robot acts on: its answers do not tell, so it is set, and seen, before what depends on it."""

import asyncio
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field

from gateway.core.errors import ControllerRefused, GatewayError, NoReply, PowerCycled
from gateway.fics.commander import Commander
from gateway.fics.errors import RobotBusy, UnitMissing, UnitNotSelected
from gateway.fics.exchange import Outcome, answered
from gateway.fics.motion_state import MotionState, Tell
from gateway.fics.power import RobotPower
from gateway.fics.questions import UNIT
from protocols.fics.link import FicsRefusal
from protocols.fics.row import OUT_OF_RANGE
from protocols.fics.system import SelectUnit, UnitNumbers

UNIT_HOLDS_S = 0.5
"""A question trusts the unit the robot has told for this time: an assumption, a loss of power is longer."""
UNIT_OF_POWER_ON = 1
"""An assumption; a robot that is configured with this unit alone never acts on another."""


@dataclass(eq=False)
class Selection:
    """The unit that a robot is known to act on (C-HOST manual 2-1)."""

    _units: Sequence[int]
    """Those of the configuration."""
    _commander: Commander
    _motion: MotionState
    _power: RobotPower
    _tell: Tell
    unit: int | None = None
    """None while it is not certain."""
    missing: set[int] = field(default_factory=set)
    """Units that the robot says it does not have."""
    _seen: set[int] = field(default_factory=set)
    """Units of which it is known whether the robot has them."""
    _holds_until: float = 0.0

    def __post_init__(self) -> None:
        self._robot_id = self._commander.robot_id

    def forget(self) -> None:
        """Anything may be selected now."""
        self.unit = None

    def doubt(self) -> None:
        """Another unit may have been selected, but not while one moves (C-HOST manual 1-7)."""
        self._holds_until = 0.0
        if self._motion.kept is None:
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
        :raises UnitMissing: the robot has no such unit.
        :raises UnitNotSelected: the robot did not answer, or acts on another unit nevertheless.
        :raises ControllerRefused: the teaching terminal keeps the robot from it.
        """
        known = self.unit == number or self._only(number)
        if known and (self._motion.command is not None or not afresh):
            return
        other_moves = self._motion.kept not in (None, number)
        before = self.unit
        if before is not None and other_moves:
            raise self._moves(number)
        found = await self._found() if afresh else None
        if found is not None and before is not None and found != before:
            self._tell("robot.unit.changed", {"expected": before, "found": found})
        if found != number:
            if other_moves:
                raise self._moves(number)
            await self._change_to(number)
            found = await self._found()
        if found != number:
            raise UnitNotSelected(
                f"Robot {self._robot_id} acts on unit {found}, not on unit {number}; nothing more was sent.",
                "See who else selects units, then try again.",
            )
        self.unit = number
        self._seen.add(number)
        self.missing.discard(number)
        self.trust()

    async def see_all(self) -> None:
        """Find out once which units the robot has, while it stands still: only a selection tells.

        It acts on the one of before then. Errors as of `make`.
        """
        unseen = [] if self._only(self._units[0]) else [it for it in self._units if it not in self._seen]
        if not unseen:
            return
        before = await self._found()
        self._seen.add(before)
        for number in unseen:
            with suppress(UnitMissing):
                await self.make(number, afresh=False)
        if self.unit != before:
            await self._change_to(before)
            await self._found()

    def _moves(self, number: int) -> RobotBusy:
        """The error where a unit is wanted while another moves."""
        return RobotBusy(
            f"Robot {self._robot_id} moves, so unit {number} cannot be selected; nothing was sent.",
            "Wait for standstill.",
        )

    def _only(self, number: int) -> bool:
        """Whether nothing else can be selected."""
        return number == UNIT_OF_POWER_ON and len(self._units) == 1

    async def _found(self) -> int:
        """The unit the robot says it acts on; what it was believed to be no longer counts."""
        self.unit, before = None, self.unit
        try:
            (reply,) = (await self._commander.ask(UNIT, fresh=True)).replies
        except NoReply:
            raise UnitNotSelected(
                f"Robot {self._robot_id} did not answer UNT, so nobody knows which unit it acts on; nothing "
                "more was sent.",
                "Try again.",
            ) from None
        except ControllerRefused:
            self.unit = before
            raise
        self.unit = reply.host_unit if isinstance(reply, UnitNumbers) else None
        return self.unit or 0

    async def _change_to(self, number: int) -> None:
        """Select a unit; whether that has worked is seen afterwards, answered or not.

        A line without a checksum may have made another number of it: what is out of range is said twice.
        """
        command = SelectUnit(unit=number)
        self.unit, before = None, self.unit
        outcome = await self._commander.say(command)
        if _is_out_of_range(outcome):
            outcome = await self._commander.say(command)
            if _is_out_of_range(outcome):
                self.unit = before
                raise self._missed(number)
        if isinstance(outcome, FicsRefusal):
            self.unit = before
        if isinstance(outcome, NoReply):
            await self._blame_power()
        else:
            answered(self._robot_id, command, outcome)

    def _missed(self, number: int) -> UnitMissing:
        """Note that the robot has no such unit, and give the error that says so."""
        self._seen.add(number)
        if number not in self.missing:
            self.missing.add(number)
            self._tell("robot.unit.missing", {"unit": number})
        return UnitMissing(self._robot_id, number)

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


def _is_out_of_range(outcome: Outcome) -> bool:
    return isinstance(outcome, FicsRefusal) and outcome.error == OUT_OF_RANGE
