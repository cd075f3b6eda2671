"""The power of a robot: what a loss takes away, what shows that it was kept, and what is set again."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import partial
from typing import Any, Final, Protocol

from gateway.core.errors import NoReply, NotSent, PowerCycled
from gateway.core.preparation import Asked
from gateway.core.preparation import Missing as CoreMissing
from gateway.core.records import AnswerModel
from gateway.fics.axes import CoordinateSystem, Tell, UnitAxes, unit_of
from gateway.fics.errors import SpeedsNotRestored, answered
from gateway.fics.exchange import MODE, PLACES, STATUS, Outcome, Proof, RobotAnswered, RobotQuestion
from protocols.fics.axis_settings import SpeedPercents
from protocols.fics.link import FicsRefusal
from protocols.fics.motor_axes import GetMotorPosition, GetMotorSpeedPercent, SetMotorSpeedPercent
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import GetSpeedPercent, SetSpeedPercent
from protocols.fics.status import AxisCoordinates, AxisStatuses, MotionMode
from protocols.fics.system import CommunicationMode, HostMode, SelectUnit
from protocols.table import Reply

History = Sequence[Asked[RobotQuestion, Outcome]]
"""The questions that were asked for a need so far, with their outcomes."""
Missing = CoreMissing[RobotQuestion, Outcome]

FULL_SPEED: Final = 100.0
"""Every speed percentage after power-on (C-HOST manual 2-15, 4-5)."""
ACKNOWLEDGE = "See that its speeds are right, acknowledge the power cycle, then home it."

Setter = type[SetSpeedPercent] | type[SetMotorSpeedPercent]
SPEEDS: Final[dict[CoordinateSystem, tuple[Setter, FicsCommand[Any]]]] = {
    "user": (SetSpeedPercent, GetSpeedPercent()),
    "motor": (SetMotorSpeedPercent, GetMotorSpeedPercent()),
}
"""The command that sets the speed percentages of a unit, and the question for them, by coordinates."""
Speeds = dict[str, float]
"""Percent by axis."""

HIDE_PLACES = (MotionMode.HOMING, MotionMode.MACRO)
"""While these go on, a robot may tell no positions, and may forget them (C-HOST manual 2-9)."""


class OriginSign(IntEnum):
    """The signs that a homed unit is homed no more, in turn."""

    PLACES = 0
    NO_PLACES = 1
    """No motor knows its place."""
    NOTHING_HIDES_THEM = 2
    """Nor does anything go on that would hide it."""
    LOST = 3
    """No motor knows its place even so."""


class Origins:
    """The units that are known to be homed, as their positions tell: a loss of power makes all unknown."""

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
        """True if a unit is known to have something that a loss of power takes away."""
        return unit.number in self._signs

    def are_complete(self, unit: UnitAxes) -> bool:
        """True if every axis of a unit is known to be homed."""
        return unit.number in self._all_placed

    def are_doubtful(self, unit: UnitAxes) -> bool:
        """True if a homed unit has just told no place."""
        return self._signs.get(unit.number, OriginSign.PLACES) is not OriginSign.PLACES

    def note(self, unit: UnitAxes, command: FicsCommand[Any], reply: Reply) -> None:
        """Learn from what a unit has told.

        User axes may have no place for want of a conversion: that tells nothing.
        """
        if isinstance(reply, AxisStatuses):
            self._note_busy(unit.number, busy=any(axis.motion_mode in HIDE_PLACES for axis in reply.axes))
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


class RobotMemory(AnswerModel):
    """The facts about a robot that a gateway remembers over restarts."""

    mode: int
    """Mode that the robot was left in: if it is in the mode of power-on afterwards, it has lost its power."""
    cycled: bool
    certain: bool
    due: set[int]
    speeds: dict[int, dict[CoordinateSystem, Speeds]]


class LineFacts(Protocol):
    """The facts about a robot's line that knowledge depends on."""

    mode: int
    absences: int

    @property
    def unheard(self) -> int:
        """The number of commands so far that may have been refused without an answer."""

    def was_set_up(self) -> None:
        """The gateway has left the robot in its mode before."""


@dataclass(eq=False)
class RobotPower:
    """The knowledge that a loss of power takes away: mode, homing, speeds."""

    robot_id: str
    units: Sequence[UnitAxes]
    line: LineFacts
    _tell: Tell
    _forget_error: Callable[[], None]
    cycled: bool = False
    """True while the robot has lost its power and the loss is not acknowledged."""
    losses: int = 0
    """Counts the losses of power that were noticed."""
    due: set[int] = field(default_factory=set)
    """The units whose speeds have to be set again before any move."""
    _speeds: dict[int, dict[CoordinateSystem, Speeds]] = field(default_factory=dict)
    """The speed percentages by unit, in user and in motor coordinates (C-HOST manual 2-15, 4-5).

    As last set, or as read before; an axis that was never set or read is missing.
    """
    _certain: bool = True
    """True while the loss that is not acknowledged is certain."""
    _absences: int | None = None
    """`FicsLine.absences` when the power was last seen to be kept or lost; None after a start."""
    on_memory: Callable[[], None] = lambda: None
    """Called when there may be something else to remember."""

    def __post_init__(self) -> None:
        self.origins = Origins(self._origins_lost)

    # over restarts

    def memory(self) -> str:
        """Give what is to be remembered."""
        mode, speeds = self.line.mode, self._speeds
        kept = RobotMemory(mode=mode, cycled=self.cycled, certain=self._certain, due=self.due, speeds=speeds)
        return kept.model_dump_json()

    def recall(self, memory: str) -> None:
        """Go on from what was remembered, as far as its units and axes are configured.

        :raises ValueError: it cannot be read.
        """
        told = RobotMemory.model_validate_json(memory)
        if told.mode == self.line.mode:
            self.line.was_set_up()
        self.cycled, self._certain = told.cycled, told.certain
        for unit in self.units:
            for coordinates in SPEEDS:
                speeds = told.speeds.get(unit.number, {}).get(coordinates, {})
                known = {axis: speeds[axis] for axis in unit.names(coordinates) if axis in speeds}
                self._speeds.setdefault(unit.number, {})[coordinates] = known
        self.due = told.due & {*self._speeds}

    # a loss

    def lost(self, *, certain: bool) -> None:
        """It was switched off and on, or seems to: keep it from moving until a person acknowledges that."""
        self.losses += 1
        self.settle_doubt(self.line.absences)
        self.due = set(self._speeds)
        self.origins.forget()  # the origins of all units are gone, and that is told once
        if not self.cycled:
            self.cycled, self._certain = True, certain
            self._forget_error()
            self._tell("robot.power_cycled", {"certain": certain, **self._speeds_told()})
        self.on_memory()

    def acknowledge(self) -> None:
        """Let the robot move again."""
        if self.cycled:
            self.cycled = False
            self._tell("robot.power_cycle.acknowledged", {})
            self.on_memory()

    def _origins_lost(self) -> None:
        """In Ver.2 a loss of power shows in homed motors without places (C-HOST manual 4-4)."""
        if self.line.mode == HostMode.VER_2:
            self.lost(certain=False)

    @property
    def in_doubt(self) -> bool:
        """True if it may have lost its power unseen: it was not asked since for what a loss would take."""
        return self.line.absences != self._absences

    def settle_doubt(self, absences: int) -> None:
        """Note that all that a loss would take was looked at when the line had this count of absences."""
        self._absences = absences

    def refusal_of(self, command: FicsCommand[Any]) -> PowerCycled:
        """The refusal of a motion until a person knows of the loss."""
        return PowerCycled(
            f"{self.what_happened()}: nothing is homed then, and speeds the gateway does not know are "
            f"100 % again; {command.wire_name()} was not sent.",
            ACKNOWLEDGE,
        )

    def require_kept(self) -> None:
        """Refuse what a loss forbids.

        :raises PowerCycled: it is not acknowledged yet.
        """
        if self.cycled:
            raise self._refusal()

    def _refusal(self) -> PowerCycled:
        return PowerCycled(f"{self.what_happened()}; nothing was sent.", ACKNOWLEDGE)

    def what_happened(self) -> str:
        """Its loss of power in words: certain, or likely."""
        has_been = "has been" if self._certain else "seems to have been"
        return f"Robot {self.robot_id} {has_been} switched off and on"

    # speeds

    def heard(self, unit: UnitAxes, query: FicsCommand[Any], found: SpeedPercents) -> None:
        """A unit was asked whether its speeds are as known: in Ver.2 full speed shows a loss of power."""
        coordinates = _coordinates(query)
        due = self.cycled or unit.number in self.due
        if not due and self.is_slower(unit, coordinates) and self._differ(unit, coordinates, found):
            self.lost(certain=False)

    def note_speeds(self, unit: UnitAxes, query: FicsCommand[Any], found: SpeedPercents) -> None:
        """Keep the speed percentages that a unit has told first."""
        if unit.number in self.due:
            return
        coordinates = _coordinates(query)
        known = self._speeds_of(unit, coordinates)
        before = len(known)
        for axis, percent in zip(unit.names(coordinates), found.percents, strict=False):
            # What was set counts: a robot tells 100 % after a loss of power nobody has seen yet.
            known.setdefault(axis, percent)
        if len(known) > before:
            self.on_memory()

    def note_set(
        self, unit: UnitAxes, command: SetSpeedPercent | SetMotorSpeedPercent, outcome: Outcome
    ) -> None:
        """Keep the speed percentages that were set; forget those that are not certain."""
        speeds = self._speeds_of(unit, _coordinates(command))
        for axis, percent in zip(unit.names(_coordinates(command)), command.percents, strict=False):
            if percent is None:
                continue
            if isinstance(outcome, RobotAnswered):
                speeds[axis] = percent
            elif isinstance(outcome, NoReply):
                speeds.pop(axis, None)
        self.on_memory()

    def note_restored(self, unit: UnitAxes) -> None:
        """The speeds of a unit were set again and read back; when all are, that is told."""
        self.due.discard(unit.number)
        if not self.due:
            self._tell("robot.speeds.restored", self._speeds_told())
            self.on_memory()

    def knows_speeds(self, unit: UnitAxes) -> bool:
        """True if the percentages of a unit are known: a loss of power may show in them."""
        return bool(self._known(unit, "user"))

    def is_slower(self, unit: UnitAxes, coordinates: CoordinateSystem) -> bool:
        """True if a loss of power would raise a speed of a unit."""
        return any(percent != FULL_SPEED for percent in self._known(unit, coordinates).values())

    def _differ(self, unit: UnitAxes, coordinates: CoordinateSystem, found: SpeedPercents) -> bool:
        told = dict(zip(unit.names(coordinates), found.percents, strict=False))
        return any(told.get(axis) != percent for axis, percent in self._known(unit, coordinates).items())

    def _setting(self, unit: UnitAxes, coordinates: CoordinateSystem) -> FicsCommand[Any] | None:
        """The command that sets the known speeds of a unit; None where none is known."""
        known = self._known(unit, coordinates)
        setter, _ = SPEEDS[coordinates]
        return setter(percents=[known.get(axis) for axis in unit.names(coordinates)]) if known else None

    def _speeds_of(self, unit: UnitAxes, coordinates: CoordinateSystem) -> Speeds:
        return self._speeds.setdefault(unit.number, {}).setdefault(coordinates, {})

    def _known(self, unit: UnitAxes, coordinates: CoordinateSystem) -> Speeds:
        """The known speeds of a unit's user or motor axes."""
        return dict(self._speeds.get(unit.number, {}).get(coordinates, {}))

    def _speeds_told(self) -> dict[str, Any]:
        """The percentages that are set again, and the axes the gateway knows none of: those are at 100 %."""
        units = {str(unit.number): unit for unit in self.units}
        return {
            "speeds": {
                number: {
                    coordinates: known for coordinates in SPEEDS if (known := self._known(unit, coordinates))
                }
                for number, unit in units.items()
            },
            "full_speed": {
                number: {
                    coordinates: [
                        axis for axis in unit.names(coordinates) if axis not in self._known(unit, coordinates)
                    ]
                    for coordinates in SPEEDS
                }
                for number, unit in units.items()
            },
        }

    # what is missing

    def restoring(self) -> list[FicsCommand[Any]]:
        """The commands that set the speeds again, and select the units they are set of."""
        commands: list[FicsCommand[Any]] = []
        for unit in self.units_due():
            settings = filter(None, (self._setting(unit, coordinates) for coordinates in SPEEDS))
            commands += [SelectUnit(unit=unit.number), *settings]
        return commands

    def units_due(self) -> list[UnitAxes]:
        """The units whose speeds have to be set again, in their order."""
        return [unit_of(self.units, number) for number in sorted(self.due)]

    def speeds_set_again(self, unit: UnitAxes, coordinates: CoordinateSystem) -> Missing:
        """Need that the known speeds of a unit, which is selected, are set again and read back."""
        return partial(self._missing_speeds, unit, coordinates)

    def _missing_speeds(
        self, unit: UnitAxes, coordinates: CoordinateSystem, heard: History
    ) -> RobotQuestion | None:
        setting = self._setting(unit, coordinates)
        if setting is None:
            return None
        told = [self._speeds_told_by(unit, asked) for asked in heard]
        if len(told) < 2:
            return RobotQuestion((setting, SPEEDS[coordinates][1])[len(told)], unit.number)
        if told[1] is None or self._differ(unit, coordinates, told[1]):
            raise self._not_restored(unit)
        return None

    def speeds_kept(
        self, unit: UnitAxes, coordinates: CoordinateSystem, proof: Proof | None = None
    ) -> Missing:
        """Need that a speed below 100 %, which a loss of power would have raised, was looked at."""
        return partial(self._missing_look_at_speeds, unit, coordinates, proof)

    def _missing_look_at_speeds(
        self, unit: UnitAxes, coordinates: CoordinateSystem, proof: Proof | None, heard: History
    ) -> RobotQuestion | None:
        if heard:
            if self._speeds_told_by(unit, heard[-1]) is None:
                raise self._not_restored(unit)
            return None
        if self.cycled or not self.is_slower(unit, coordinates):
            return None
        return RobotQuestion(SPEEDS[coordinates][1], unit.number, proof=proof)

    def _speeds_told_by(self, unit: UnitAxes, asked: Asked[RobotQuestion, Outcome]) -> SpeedPercents | None:
        """The speeds that an answer tells, if it tells any.

        :raises SpeedsNotRestored: there was no answer.
        :raises GatewayError: it was refused, or not sent.
        """
        if isinstance(asked.outcome, NoReply):
            raise self._not_restored(unit) from None
        replies = answered(self.robot_id, asked.question.command, asked.outcome).replies
        return next((reply for reply in replies if isinstance(reply, SpeedPercents)), None)

    def _not_restored(self, unit: UnitAxes) -> SpeedsNotRestored:
        return SpeedsNotRestored(
            f"The speeds of {unit.address} are not certain after a loss of power; nothing was moved.",
            "Set them, then try again.",
        )

    def mode_kept(self, proof: Proof | None = None) -> Missing:
        """Need that the robot has not been switched off: it would be in Ver.2 then.

        Where that is its own mode only the signs of a unit can tell.
        """
        return partial(self._missing_mode, proof)

    def _missing_mode(self, proof: Proof | None, heard: History) -> RobotQuestion | None:
        if self.line.mode == HostMode.VER_2:
            return None
        if not heard:
            return RobotQuestion(MODE, proof=proof)
        if isinstance(heard[-1].outcome, FicsRefusal):
            return None  # only Ver.3 refuses
        reply = reply_of(self.robot_id, self.robot_id, heard[-1])
        if isinstance(reply, CommunicationMode) and reply.mode != self.line.mode:
            raise self._refusal()
        return None

    def origins_seen(self, unit: UnitAxes, proof: Proof | None = None) -> Missing:
        """Need that a unit, which is selected, has told whether it is still homed."""
        return partial(self._missing_origins, unit, proof)

    def _missing_origins(self, unit: UnitAxes, proof: Proof | None, heard: History) -> RobotQuestion | None:
        if heard:
            reply_of(self.robot_id, unit.address, heard[-1])
        questions = (PLACES, STATUS, PLACES)
        if len(heard) == len(questions) or (heard and not self.origins.are_doubtful(unit)):
            return None
        return RobotQuestion(questions[len(heard)], unit.number, proof=proof)

    def kept(self, command: FicsCommand[Any], unit: UnitAxes, proof: Proof | None) -> Iterator[Missing]:
        """Needs before a motion that the power was kept: by the mode, in Ver.2 by origins and speeds.

        The signs that a loss would take away are looked at last. The unit is selected.
        """
        if self.line.mode != HostMode.VER_2:
            yield self.mode_kept(proof)
            return
        origins = self.origins_seen(unit, proof)
        speeds = self.speeds_kept(unit, unit.coordinates_of(command), proof)
        yield from (speeds, origins) if self.origins.are_known(unit) else (origins, speeds)
        self.require_kept()

    def signs(self, command: FicsCommand[Any], unit: UnitAxes, *, joining: bool) -> list[FicsCommand[Any]]:
        """The questions that may prove before a motion that the power was kept.

        One that is `joining` others joins axes that jog.
        """
        if joining:
            return [STATUS]
        if self.line.mode != HostMode.VER_2:
            return [MODE]
        return [SPEEDS[unit.coordinates_of(command)][1], PLACES]

    def witnesses_beside(self, unit: UnitAxes) -> list[UnitAxes]:
        """The units where a loss of power would show, where this one is not known to be homed.

        Units whose speeds alone would tell are asked only in doubt.
        """
        if self.origins.are_known(unit):
            return []
        homed = next(filter(self.origins.are_known, self.units), None)
        if homed is not None:
            return [homed]
        if not self.in_doubt:
            return []
        return [
            other
            for other in self.units
            if other is not unit and any(self.is_slower(other, at) for at in SPEEDS)
        ]


def reply_of(robot_id: str, who: str, asked: Asked[RobotQuestion, Outcome]) -> Reply:
    """The reply to what tells of a loss of power.

    :raises NotSent: there was no answer.
    :raises GatewayError: it was refused, or not sent.
    """
    if isinstance(asked.outcome, RobotAnswered):
        (reply,) = asked.outcome.replies
        return reply
    if isinstance(asked.outcome, NoReply):
        raise NotSent(
            f"{who} did not answer {asked.question.command.wire_name()}, so nobody knows whether it has lost "
            "its power; nothing more was sent.",
            "Try again.",
        ) from None
    (reply,) = answered(robot_id, asked.question.command, asked.outcome).replies
    return reply


def _coordinates(command: FicsCommand[Any]) -> CoordinateSystem:
    motors = SetMotorSpeedPercent | GetMotorSpeedPercent | GetMotorPosition
    return "motor" if isinstance(command, motors) else "user"
