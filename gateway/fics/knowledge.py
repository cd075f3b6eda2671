"""All that is known of one robot, since when, and what ends it; and what a command still needs to know."""

import asyncio
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

from gateway.core.errors import ControllerRefused, GatewayError, NoReply, NotSent, Outdated, PowerCycled
from gateway.fics.axes import AxisDurations, CoordinateSystem, Tell, UnitAxes
from gateway.fics.bits import AxisEdges, Bits
from gateway.fics.errors import ErrorStands, RobotBusy, UnitMissing, UnitNotSelected, answered
from gateway.fics.exchange import STATUS, UNIT, Outcome, Proof, RobotAnswered, RobotQuestion
from gateway.fics.motion_state import MOVES_ALL_UNITS, MotionState
from gateway.fics.power import SPEEDS, History, LineFacts, Missing, RobotPower, reply_of
from gateway.fics.system_errors import StandingError
from protocols.fics.alarms import TakeCurrentError
from protocols.fics.axis_settings import AxisSetting, AxisTimes, SpeedPercents
from protocols.fics.link import FicsRefusal
from protocols.fics.macros import RunMacro
from protocols.fics.motor_axes import SetMotorSpeedPercent
from protocols.fics.row import OUT_OF_RANGE, FicsCommand
from protocols.fics.speeds import SetSpeedPercent
from protocols.fics.status import AxisCoordinates, AxisStatuses, MotionMode, SensorStates
from protocols.fics.system import GetUnit, HostMode, SelectUnit, UnitNumbers
from protocols.table import Reply

UNIT_HOLDS_S = 0.5
"""A question trusts the unit the robot has told for this time: an assumption, a loss of power is longer."""
UNIT_OF_POWER_ON = 1
"""An assumption; a robot that is configured with this unit alone never acts on another."""
Learn = Callable[[UnitAxes, FicsCommand[Any], Any], None]
"""Called with a unit, what it was asked, and its reply."""
SAID_AGAIN: Final = 2
"""Attempts at a selection that is out of range: the line may have made another number of it."""


class SelectedUnit:
    """The unit that a robot is known to act on: its answers do not tell (C-HOST manual 2-1)."""

    def __init__(self, robot_id: str, units: Sequence[UnitAxes], motion: MotionState, tell: Tell) -> None:
        self._robot_id = robot_id
        self._units = [unit.number for unit in units]
        """The units of the configuration."""
        self._motion = motion
        self._tell = tell
        self.number: int | None = None
        """Number of the selected unit; None while it is not certain."""
        self.missing: set[int] = set()
        """Units that the robot says it does not have."""
        self._before: int | None = None
        """`number` before the question that is under way."""
        self._seen: set[int] = set()
        """Units of which it is known whether the robot has them."""
        self.holds_until = 0.0
        """Time until which a question trusts the unit that the robot has told."""
        self.is_alone = self._units == [UNIT_OF_POWER_ON]
        """True if nothing else can be selected."""

    def forget(self) -> None:
        """Anything may be selected now."""
        self.number = None

    def doubt(self) -> None:
        """Another unit may have been selected, but not while one moves (C-HOST manual 1-7)."""
        self.holds_until = 0.0
        if self._motion.kept is None:
            self.forget()

    def trust(self) -> None:
        """The robot has told its unit, or will not tell it."""
        self.holds_until = asyncio.get_running_loop().time() + UNIT_HOLDS_S

    def unseen(self) -> list[int]:
        """The units that the robot was not seen to have: only a selection tells."""
        return [] if self.is_alone else [number for number in self._units if number not in self._seen]

    def _is_known(self, number: int) -> bool:
        return self.number == number or self.is_alone

    # what is sent and heard

    def sent(self, command: FicsCommand[Any]) -> None:
        """The robot is asked for its unit, or told one: what was believed counts no more."""
        if isinstance(command, GetUnit | SelectUnit):
            self._before, self.number = self.number, None

    def heard(self, question: RobotQuestion, outcome: Outcome) -> None:
        """Note the outcome of a question for the unit, or of a selection; a refusal changes nothing."""
        if not isinstance(question.command, GetUnit | SelectUnit):
            return
        if isinstance(outcome, FicsRefusal):
            self.number = self._before
        elif isinstance(question.command, GetUnit) and isinstance(outcome, RobotAnswered):
            self._note_told(_told_by(outcome), question.unit)

    def _note_told(self, found: int, wanted: int | None) -> None:
        self.number = found
        if self._before is not None and found != self._before:
            self._tell("robot.unit.changed", {"expected": self._before, "found": found})
        if found == wanted:
            self.note_seen(found)
            self.missing.discard(found)
            self.trust()

    def note_seen(self, number: int) -> None:
        """The robot acts on a unit, so it has it."""
        self._seen.add(number)

    def note_missing(self, number: int) -> None:
        """The robot has no such unit, as it says."""
        self._seen.add(number)
        if number not in self.missing:
            self.missing.add(number)
            self._tell("robot.unit.missing", {"unit": number})

    # what is missing

    def told(self, heard: History) -> RobotQuestion | None:
        """Need that the robot tells the unit it acts on, whichever that is."""
        if not heard:
            return RobotQuestion(UNIT, fresh=True)
        self._told(heard)
        return None

    def selected(self, number: int, power: RobotPower, *, afresh: bool) -> Missing:
        """Need that a unit is selected; `afresh` asks the robot even where the gateway knows.

        A robot that moves is asked, too, where its unit is not known, as after a restart in the middle of a
        move: it refuses that until the unit it acts on stands still (C-HOST manual 1-7). The need raises

        :raises RobotBusy: the robot moves, and while it does no other unit can be selected.
        :raises UnitMissing: the robot has no such unit.
        :raises UnitNotSelected: the robot did not answer, or acts on another unit nevertheless.
        :raises ControllerRefused: the teaching terminal keeps the robot from it.
        """
        return partial(self._missing_selection, number, power, afresh)

    def _missing_selection(
        self, number: int, power: RobotPower, afresh: bool, heard: History
    ) -> RobotQuestion | None:
        if not heard:
            return self._first_question(number, afresh=afresh)
        last = heard[-1].question.command
        if isinstance(last, SelectUnit):
            return self._after_selection(number, power, heard)
        if not isinstance(last, GetUnit):
            _heed_mode(power, heard[-1:])
            return RobotQuestion(UNIT, number, fresh=True)
        found = self._told(heard)
        if found == number:
            return None
        if any(isinstance(asked.question.command, SelectUnit) for asked in heard):
            raise UnitNotSelected(
                f"Robot {self._robot_id} acts on unit {found}, not on unit {number}; nothing more was sent.",
                "See who else selects units, then try again.",
            )
        return self._selection(number)

    def _first_question(self, number: int, *, afresh: bool) -> RobotQuestion | None:
        if self._is_known(number) and (self._motion.command is not None or not afresh):
            return None
        if not afresh:
            return self._selection(number)
        if self.number is not None:
            self._require_rest_of_others(number)
        return RobotQuestion(UNIT, number, fresh=True)

    def _selection(self, number: int) -> RobotQuestion:
        self._require_rest_of_others(number)
        return RobotQuestion(SelectUnit(unit=number), number)

    def _after_selection(self, number: int, power: RobotPower, heard: History) -> RobotQuestion:
        """Another number may have been made of a selection that is out of range: it is said again.

        It is seen afterwards if it has worked, answered or not; silence may be that of power-on (Ver.2).
        """
        command, outcome = heard[-1].question.command, heard[-1].outcome
        if _is_out_of_range(outcome):
            if sum(_is_out_of_range(asked.outcome) for asked in heard) == SAID_AGAIN:
                raise UnitMissing(self._robot_id, number)
            return RobotQuestion(SelectUnit(unit=number), number)
        asked = RobotQuestion(UNIT, number, fresh=True)
        if isinstance(outcome, NoReply):
            return power.mode_kept()(()) or asked
        answered(self._robot_id, command, outcome)
        return asked

    def _told(self, heard: History) -> int:
        """The unit that the robot has told.

        :raises UnitNotSelected: it has not answered.
        :raises GatewayError: it has refused, or was not asked.
        """
        if isinstance(heard[-1].outcome, NoReply):
            raise UnitNotSelected(
                f"Robot {self._robot_id} did not answer UNT, so nobody knows which unit it acts on; nothing "
                "more was sent.",
                "Try again.",
            ) from None
        outcome = heard[-1].outcome
        if isinstance(outcome, RobotAnswered):
            return _told_by(outcome)
        return _told_by(answered(self._robot_id, UNIT, outcome))

    def _require_rest_of_others(self, number: int) -> None:
        if self._motion.kept not in (None, number):
            raise RobotBusy(
                f"Robot {self._robot_id} moves, so unit {number} cannot be selected; nothing was sent.",
                "Wait for standstill.",
            )


def _heed_mode(power: RobotPower, heard: History) -> None:
    """Heed the mode that is told after a silent selection; where it is not told, the robot is simply silent.

    :raises PowerCycled: it is that of power-on.
    """
    try:
        power.mode_kept()(heard)
    except PowerCycled:
        raise
    except GatewayError:
        return


def _told_by(outcome: RobotAnswered) -> int:
    (reply,) = outcome.replies
    return reply.host_unit if isinstance(reply, UnitNumbers) else 0


def _is_out_of_range(outcome: Outcome) -> bool:
    return isinstance(outcome, FicsRefusal) and outcome.error == OUT_OF_RANGE


class Knowledge:
    """All that is known of one robot. It asks nothing; it hears what is sent, told, refused and lost."""

    def __init__(
        self, robot_id: str, line: LineFacts, units: Sequence[UnitAxes], tell: Tell, bits: Bits | None = None
    ) -> None:
        self.robot_id = robot_id
        self.line = line
        self.units: Mapping[int, UnitAxes] = {unit.number: unit for unit in units}
        self.bits = bits or Bits()
        self.motion = MotionState(robot_id, tell)
        self.error = StandingError(tell)
        self.power = RobotPower(robot_id, units, line, tell, self.error.forget)
        self.unit = SelectedUnit(robot_id, units, self.motion, tell)
        self.settings_changed = 0
        """Count of the times that a setting of an axis may have changed."""
        self.durations: dict[tuple[int, CoordinateSystem], AxisDurations] = {}
        """Speeds and ramps of the axes of a unit by the settings that were read last."""
        self.said = 0
        """Count of the commands that may have changed what was read before."""
        edges = AxisEdges(tell)
        self._learners: Mapping[type[Reply], Sequence[Learn]] = {
            AxisCoordinates: [self.power.origins.note],
            AxisStatuses: [self.power.origins.note, edges.note_status],
            SensorStates: [edges.note_sensors],
            AxisTimes: [self.motion.ramps.note],
            SpeedPercents: [self.power.note_speeds],
        }
        """Called with the replies of a unit, by their type."""

    # what is sent and heard

    def sent(self, question: RobotQuestion) -> None:
        """A question goes out that a command needs."""
        self.unit.sent(question.command)

    def heard(self, question: RobotQuestion, outcome: Outcome) -> None:
        """Learn from the outcome of a question that a command needs."""
        self.unit.heard(question, outcome)
        if not isinstance(outcome, RobotAnswered) or question.unit is None:
            return
        for reply in outcome.replies:
            if isinstance(reply, AxisCoordinates | AxisStatuses):
                self.power.origins.note(self.units[question.unit], question.command, reply)
            elif isinstance(reply, SpeedPercents):
                self.power.heard(self.units[question.unit], question.command, reply)

    def replied(self, command: FicsCommand[Any], number: int | None, replies: Sequence[Reply]) -> None:
        """Learn from what a unit has told."""
        if number is None:
            return
        for reply in replies:
            for learn in self._learners.get(type(reply), ()):
                learn(self.units[number], command, reply)

    def acted(self, command: FicsCommand[Any], number: int | None, outcome: Outcome) -> None:
        """Note what an action may have changed."""
        if isinstance(command, SelectUnit):
            self.unit.forget()
        if isinstance(command, SetSpeedPercent | SetMotorSpeedPercent) and number is not None:
            self.power.note_set(self.units[number], command, outcome)
        if isinstance(command, AxisSetting):
            self.note_change()
        if isinstance(outcome, RobotAnswered):
            self.replied(command, number, outcome.replies)

    def moves(self, command: FicsCommand[Any], unit: int) -> None:
        """A motion command of ours was written."""
        self.motion.begin(command, unit)
        if isinstance(command, MOVES_ALL_UNITS):
            self.power.origins.forget()
            self.bits.compare_again()

    def note_change(self) -> None:
        """Settings may be others now."""
        self.settings_changed += 1
        self.durations.clear()

    def begin_to_say(self, since: int | None) -> None:
        """Something is about to be said that may change what was read; the sequence lock is held.

        :raises Outdated: something else was said `since`.
        """
        if since not in (None, self.said):
            raise Outdated
        self.said += 1

    # what ends it

    def doubt(self) -> None:
        """The robot was out of reach, or left alone: others may have moved it, or selected another unit."""
        if self.motion.command is None:
            self.unit.forget()  # in motion no other unit can be selected
        self.motion.doubt()

    def power_lost(self) -> None:
        """The robot was found in the mode of power-on: all that a loss of power takes away is gone."""
        self.power.lost(certain=True)
        self.unit.forget()
        self.motion.ramps.forget()

    # what is missing

    def require_fit(self, command: FicsCommand[Any]) -> None:
        """Refuse motion while the robot is not fit for it.

        :raises NotSent: power was lost, or an error stands.
        :raises RobotBusy: something moves, or a stop is not confirmed.
        """
        if self.power.cycled:
            raise self.power.refusal_of(command)
        if (error := self.error.latched) is not None:
            raise ErrorStands(command.wire_name(), error.code, error)
        self.motion.require_still(command)

    def selected(self, number: int, *, afresh: bool) -> Missing:
        """Need that a unit is selected; errors as of `SelectedUnit.selected`."""
        return self.unit.selected(number, self.power, afresh=afresh)

    def of_motion(self, command: FicsCommand[Any], unit: UnitAxes, proof: Proof) -> Iterator[Missing]:
        """Needs of a motion: no older error, the speeds, the unit, and last that the power was kept.

        :raises NotSent: something forbids the motion.
        """
        if self.line.mode == HostMode.VER_2:
            yield self.error_told
            self.require_fit(command)
        if self.motion.command is not None:
            yield partial(self._missing_jog, unit, proof)
        else:
            yield from self.speeds_restored()
            yield self.selected(unit.number, afresh=True)
            yield from self.power.kept(command, unit, proof)
        self.require_fit(command)

    def speeds_restored(self) -> Iterator[Missing]:
        """Needs that the speeds are set again, and read back, which a loss of power has taken away."""
        if not self.power.due:
            return
        yield self.power.mode_kept()
        for unit in self.power.units_due():
            yield self.selected(unit.number, afresh=True)
            for coordinates in SPEEDS:
                yield self.power.speeds_set_again(unit, coordinates)
            self.power.note_restored(unit)

    def error_told(self, heard: History) -> RobotQuestion | None:
        """Need that the robot tells its error: in Ver.2 one that stands would hide the next refusal.

        :raises NotSent: it did not tell, so a refusal of what follows could not be told.
        """
        if not heard:
            return RobotQuestion(TakeCurrentError())
        if isinstance(heard[-1].outcome, NoReply):
            raise NotSent(
                f"Robot {self.robot_id} did not tell its last error, so nobody could tell whether it "
                "refuses the command; nothing was sent.",
                "Try again.",
            ) from None
        answered(self.robot_id, heard[-1].question.command, heard[-1].outcome)
        return None

    def older_error_told(self, heard: History) -> RobotQuestion | None:
        """Need in Ver.2 that no refusal of an earlier command is taken for that of the next."""
        if not heard and not (
            self.line.mode == HostMode.VER_2 and self.line.unheard != self.error.asked_after
        ):
            return None
        return self.error_told(heard)

    def _missing_jog(self, unit: UnitAxes, proof: Proof, heard: History) -> RobotQuestion | None:
        """Need that an axis of a unit jogs, which another is to join: MOD and UNT are refused meanwhile.

        A robot tells of the unit it acts on, and after a loss of power nothing jogs (C-HOST manual 2-10).
        """
        if not heard:
            return RobotQuestion(STATUS, proof=proof)
        reply = reply_of(self.robot_id, unit.address, heard[-1])
        axes = reply.axes if isinstance(reply, AxisStatuses) else []
        if any(axis.motion_mode == MotionMode.JOG for axis in axes):
            return None
        raise RobotBusy(
            f"The JOG of {unit.address} is not over, but no axis was seen to jog; nothing was sent.",
            "Try again when all axes are known to stand still.",
        )


UNKNOWN = "E12"
"""The refusal of a macro that the robot does not have."""


@dataclass
class Macros:
    """Macros by the configuration, and those that the robot has refused since the gateway was started."""

    titles: Mapping[str, str] = field(default_factory=dict)
    refused: set[str] = field(default_factory=set)

    def names(self) -> list[str]:
        """All names, those of the configuration first."""
        return [*self.titles, *sorted(self.refused - self.titles.keys())]

    def note(self, command: object, refusal: ControllerRefused | None) -> None:
        """Note whether the robot has a macro, when it has answered its call."""
        if not isinstance(command, RunMacro):
            return
        if refusal is None:
            self.refused.discard(command.macro)
        elif refusal.error_code == UNKNOWN:
            self.refused.add(command.macro)
