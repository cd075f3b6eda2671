"""Facts of a body, with their times and their ends: plain data that hears of each exchange.

A tracker asks nothing and has no clock. The ends of the facts of `BodyFacts` are a table, drawn into
docs/body-states.md.
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from protocols.rorze.commands import COMMANDS
from protocols.rorze.encoder import SetEncoderRatio
from protocols.rorze.flash import EraseFlash, LoadPositions, LoadProgram, SavePositions, SaveSettings
from protocols.rorze.inputs_outputs import Inputs, Sensors, SetInterruptAction
from protocols.rorze.interpolation import Preparation, SetStartPosition
from protocols.rorze.modes import OperatingMode, SetOperatingMode
from protocols.rorze.patterns import PatternSpeedSets, SetPattern
from protocols.rorze.position import GetPosition, SetEncoderCount, SetPosition, SignedPulses
from protocols.rorze.position_table import NumberedPositionEntry, SetPositionEntry
from protocols.rorze.programs import (
    AddProgramInstruction,
    ClearProgram,
    ProgramStatus,
    RunProgram,
    StepProgram,
)
from protocols.rorze.row import ModeName, RorzeCommand
from protocols.rorze.speeds import SetFallingAccelerationShare, SetRisingAccelerationShare
from protocols.rorze.status import (
    CONTROLLER_STATUS_BITS,
    SENSOR_BITS,
    ClearControllerStatus,
    ControllerStatus,
)
from protocols.table import Effect, Reply

PULSES_RUNNING: Final = 0x01
"""Bit of the controller status (9CD)."""
PROGRAM_RUNS: Final = 1
"""Bit 0 of a program's status (URD)."""
RENAMING: Final = (SetPosition, SetEncoderCount, SetEncoderRatio, SetOperatingMode)
"""Commands after which the same place has another number."""
STARTS_PROGRAM: Final = (RunProgram, StepProgram)

Tell = Callable[[str, dict[str, object]], None]
"""Type and data of an event."""
AnyRow = type[RorzeCommand[Any]]


class Tracker:
    """Facts of one kind about a body."""

    def sent(self, command: RorzeCommand[Any], *, is_known: bool) -> None:
        """A command that is no read was queued, or its outcome is known; `is_known`: it is in the manual."""

    def done(self, command: RorzeCommand[Any], *, certain: bool) -> None:
        """A command that is no read was executed, or without a reply may have been."""

    def replied(self, question: RorzeCommand[Any], reply: Reply, at: float) -> None:
        """It has answered."""

    def refused(self, command: RorzeCommand[Any]) -> None:
        """It has refused a command."""

    def may_move(self) -> None:
        """Something may have set it going."""

    def silent(self) -> None:
        """It cannot be asked: it may move, or lose its power."""

    def powered_on(self, *, certain: bool) -> None:
        """It was switched off and on, or seems to have been."""

    def reported(self, fields: Mapping[str, int]) -> None:
        """It has reported a change of its state unasked (RC-420 manual 13.11)."""


class Trackers:
    """All trackers of a body."""

    def __init__(self, *trackers: Tracker) -> None:
        self._trackers = trackers
        self._heeding: dict[str, Sequence[Tracker]] = {}

    def heeding(self, event: Callable[..., None]) -> Sequence[Tracker]:
        """The trackers that heed an event, which is named by its method of `Tracker`."""
        name = event.__name__
        if name not in self._heeding:
            self._heeding[name] = [
                tracker for tracker in self._trackers if getattr(type(tracker), name) is not event
            ]
        return self._heeding[name]


# what it has told


class MotorState(NamedTuple):
    """A controller's answer about its motor."""

    bits: int
    position: int
    cause: int = 0
    """The cause of the last end (9MD), where it was asked for."""

    @property
    def runs(self) -> bool:
        """True if pulses run."""
        return bool(self.bits & PULSES_RUNNING)


class PlaceRead(NamedTuple):
    """A position that was read."""

    position: int
    """Position in pulses, or in encoder counts, by the operating mode."""
    at: float
    """Time of the answer on the event loop's clock."""


class EndedBy(NamedTuple):
    """The news that ends a fact, besides a newer answer."""

    commands: tuple[AnyRow, ...] = ()
    unknown: bool = False
    """A command that the manual's table does not have."""
    all: bool = False
    """Every command that is no read."""
    motion: bool = False
    """Something may have set it going."""
    silence: bool = False
    """The body cannot be asked."""
    power: bool = False
    """True if a loss of power, or its acknowledgement, ends it."""

    def drawn(self) -> tuple[str, ...]:
        """Its cells in the page of the documentation."""
        codes = ["all but reads"] * self.all or [
            *dict.fromkeys(code for row in self.commands for code in _codes_of(row)),
            *["unknown ones"] * self.unknown,
        ]
        return ", ".join(codes) or "–", *(
            "ends" if ends else "–" for ends in (self.motion, self.silence, self.power)
        )


def _codes_of(row: AnyRow) -> list[str]:
    return [code for code, known in COMMANDS.items() if issubclass(known, row)]


ENDS: Final[Mapping[str, EndedBy]] = {
    "rest": EndedBy(all=True, motion=True, silence=True),
    "place": EndedBy(RENAMING),
    "mode": EndedBy((SetOperatingMode,), motion=True, silence=True, power=True),
    "pattern_sets": EndedBy((SetPattern,), unknown=True, power=True),
    "no_program_at": EndedBy(motion=True, silence=True, power=True),
    "program_ends": EndedBy(
        (ClearProgram, AddProgramInstruction, LoadProgram), unknown=True, silence=True, power=True
    ),
}
"""Ends of the facts in `BodyFacts`, by name. A program may start with the power (RC-420 manual 14, UAS)."""
_UNKNOWN: Final[Mapping[str, Any]] = {"pattern_sets": MappingProxyType({}), "program_ends": False}
_BY_MOTION: Final = [fact for fact, by in ENDS.items() if by.motion]
_BY_SILENCE: Final = [fact for fact, by in ENDS.items() if by.silence]
_BY_POWER: Final = [fact for fact, by in ENDS.items() if by.power]
_BY_UNKNOWN: Final = [fact for fact, by in ENDS.items() if by.unknown or by.all]
_BY_ANY: Final = [fact for fact, by in ENDS.items() if by.all]
_BY_ROW: Final[Mapping[AnyRow, list[str]]] = {
    row: [*_BY_ANY, *(fact for fact, by in ENDS.items() if row in by.commands)]
    for row in dict.fromkeys(row for by in ENDS.values() for row in by.commands)
}


@dataclass(eq=False)
class BodyFacts(Tracker):
    """The last answers of a body."""

    heard_at: float | None = None
    """Time of its last answer, alone or as a member of a group, on the event loop's clock."""
    sent_count: int = 0
    """Counts the commands sent to it that are no reads: a poll around one of these has seen two states."""
    changes: int = 0
    """Counts the commands that may have changed its settings."""
    rest: MotorState | None = None
    """The answer when it was last seen at rest; None once it may have moved since."""
    rest_at: float = 0.0
    status_bits: int | None = None
    place: PlaceRead | None = None
    """The last position that it told; None where that place may have another number now."""
    mode: ModeName | None = None
    """The operating mode (EAD)."""
    pattern_sets: Mapping[int, PatternSpeedSets] = field(default_factory=dict)
    """The speed sets of its patterns: in motion it does not tell them."""
    no_program_at: float | None = None
    """Time of its last answer that no user program runs; None where one may have been started since."""
    program_ends: bool = False
    """True if its program was read, has no move without an end, and was not changed since."""

    def sent(self, command: RorzeCommand[Any], *, is_known: bool) -> None:
        """Count it, and end what it ends."""
        self.sent_count += 1
        self.changes += command.effect in (Effect.SETTING, Effect.CLEARING, Effect.MAINTENANCE)
        self._end(_BY_ROW.get(type(command), _BY_ANY) if is_known else _BY_UNKNOWN)

    def replied(self, question: RorzeCommand[Any], reply: Reply, at: float) -> None:
        """Take what was asked for."""
        self.heard_at = at
        if type(reply) is SignedPulses:
            if type(question) is GetPosition:
                self.place = PlaceRead(reply.pulses, at)
        elif type(reply) is ControllerStatus:
            self.status_bits = self.status_bits if reply.bits is None else reply.bits
        elif type(reply) is ProgramStatus:
            self.no_program_at = None if reply.status & PROGRAM_RUNS else at
        elif type(reply) is OperatingMode:
            self.mode = reply.mode
        elif type(reply) is PatternSpeedSets:
            number = getattr(question, "pattern", None)
            if number is not None:
                self.pattern_sets = {**self.pattern_sets, number: reply}

    @property
    def position(self) -> int | None:
        """Where it said last that it stands; None where that place may have another number now."""
        return None if self.place is None else self.place.position

    def rests(self, state: MotorState, at: float, sent_count: int) -> None:
        """Note the answer to a poll; it holds unless commands were sent since the count was `sent_count`."""
        self.rest = None if state.runs or self.sent_count != sent_count else state
        self.rest_at = at

    def rest_in_doubt(self) -> None:
        """Where it rests has to be asked anew."""
        self.rest = None

    def program_was_read(self) -> None:
        """No move of its program is without an end."""
        self.program_ends = True

    def runs_by_itself(self) -> None:
        """It runs, and no move of the gateway makes it: a program may."""
        self.no_program_at = None

    def may_move(self) -> None:
        """End what a motion ends."""
        self._end(_BY_MOTION)

    def silent(self) -> None:
        """End what may change unseen."""
        self._end(_BY_SILENCE)

    def power_in_question(self) -> None:
        """End the facts that go with the power: it was lost, or the loss was acknowledged."""
        self._end(_BY_POWER)

    def _end(self, facts: Iterable[str]) -> None:
        for fact in facts:
            setattr(self, fact, _UNKNOWN.get(fact))


@dataclass(eq=False)
class Prepared(Tracker):
    """The preparation of an interpolated move (RC-420 manual 13.10.7)."""

    is_prepared: bool | None = None
    """True if one was prepared since it got positions or moved; None: not known."""
    pattern_of_move: int | None = None
    """The acceleration pattern of its last move; None: the standard one, or not known."""
    _pattern: int | None = None
    """The acceleration pattern of the interpolated move that was prepared last."""

    def done(self, command: RorzeCommand[Any], *, certain: bool) -> None:
        """Note it: a preparation counts from the positions told before it (HPS)."""
        if isinstance(command, Preparation):
            self.is_prepared, self._pattern = certain, command.pattern
        elif type(command) is SetStartPosition:
            self.is_prepared = False

    def powered_on(self, *, certain: bool) -> None:  # noqa: ARG002
        """It is forgotten."""
        self.is_prepared = False

    def moves(self, command: RorzeCommand[Any]) -> None:
        """A motion command is on the wire: it was prepared for once."""
        self.pattern_of_move = self.pattern_of(command)
        self.is_prepared = False

    def pattern_of(self, command: RorzeCommand[Any]) -> int | None:
        """The acceleration pattern of a motion command; an interpolated one has that of its preparation."""
        prepared = None if self.is_prepared is False else self._pattern
        pattern: int | None = getattr(command, "pattern", prepared)
        return pattern


# its refusals

COMMAND_ERROR: Final = 1 << CONTROLLER_STATUS_BITS.index("command_error")


class OwnRefusals(Tracker):
    """The command error of a body, where only questions of the gateway can have caused it."""

    def __init__(self) -> None:
        self._known_clear = False
        """True if its status had no command error when it was last read, and nothing was refused since."""
        self._looking = 0
        self.are_ours = False
        """True if a command error that stands now can only be that of a question of ours."""
        self._refused = False

    def replied(self, question: RorzeCommand[Any], reply: Reply, at: float) -> None:  # noqa: ARG002
        """Note the error bit of its status."""
        if type(reply) is ControllerStatus and reply.bits is not None:
            self._known_clear = not reply.bits & COMMAND_ERROR

    def done(self, command: RorzeCommand[Any], *, certain: bool) -> None:
        """Note that its errors were cleared."""
        self._known_clear |= certain and type(command) is ClearControllerStatus

    def refused(self, command: RorzeCommand[Any]) -> None:
        """Note that it has refused a command: one that is no question was a caller's."""
        self._known_clear = False
        self._refused = True
        self.are_ours = self.are_ours and command.effect is Effect.READ

    def look(self) -> None:
        """Questions begin that may be refused, such as SPD of a pattern never set."""
        if not self._looking:
            self.are_ours, self._refused = self._known_clear, False
        self._looking += 1

    def have_to_be_cleared(self) -> bool:
        """These questions are over; of several who look at once the last clears."""
        self._looking -= 1
        return not self._looking and self._refused and self.are_ours


# its flash memory

KEPT: Final = re.compile("0[BRS]|9V|C[CEFPS]|D[CIL]|E[ADP]|H[ACFTZ]|O[ABHLS]|P[ABEJKLST]|Q[IS]|SP|UA")
"""The settings that FIS keeps, by the first two characters of the commands; but the position index (3I),
which moves step, and the outputs (CO), which pulses, interrupts and errors switch."""
SHARES: Final = (SetRisingAccelerationShare, SetFallingAccelerationShare)
"""Settings of which 0 is a value; in a set where they were never set they read as 0, too (OAD, OBD)."""
_UNSEEN: Final = frozenset((*STARTS_PROGRAM, EraseFlash))
"""Commands after which either memory may hold something else."""


@dataclass(eq=False)
class FlashPositions(Tracker):
    """The positions in flash memory, as far as known (RC-420 manual 13.4).

    Nothing can ask a controller for it. But FPS writes the whole table there, and FPD reads it back: from
    then on a position is the same in both until it is set.
    """

    _same: bool = False
    """True if RAM holds the same, but for what was set since."""
    _set: set[int] = field(default_factory=set)
    _held: dict[int, int] = field(default_factory=dict)

    def held(self, number: int) -> int | None:
        """The pulses of a position in flash memory; None where that is not known."""
        return self._held.get(number)

    def held_of(self, numbers: Iterable[int]) -> dict[int, int]:
        """The pulses of positions in flash memory, as far as they are known."""
        return {number: self._held[number] for number in numbers if number in self._held}

    def sent(self, command: RorzeCommand[Any], *, is_known: bool) -> None:
        """Note what may differ between both memories from now on."""
        if not is_known or type(command) is EraseFlash:
            self.forget()
        elif type(command) in STARTS_PROGRAM:  # they may set positions, and cannot save them
            self._same = False
        elif type(command) is SetPositionEntry and isinstance(command.entry.position, int):
            self._set.add(command.entry.position)
        elif type(command) is SetInterruptAction:
            self._set |= set() if command.number is None else {command.number}
        elif command.effect is Effect.SETTING and command.code[0] == "3":
            self._same = False

    def done(self, command: RorzeCommand[Any], *, certain: bool) -> None:
        """Note that both memories hold the same, or may."""
        if type(command) is SavePositions:
            self.forget()
            self._same = certain
        elif type(command) is LoadPositions:
            self._set.clear()
            self._same = certain

    def replied(self, question: RorzeCommand[Any], reply: Reply, at: float) -> None:  # noqa: ARG002
        """Take a position that is the same in both."""
        if type(reply) is NumberedPositionEntry and self._same and reply.position not in self._set:
            self._held[reply.position] = reply.pulses

    def powered_on(self, *, certain: bool) -> None:  # noqa: ARG002
        """RAM holds what flash memory does, unless an autostarted program has changed it."""
        self._same = False

    def forget(self) -> None:
        """Forget the positions in flash memory."""
        self._same = False
        self._set.clear()
        self._held.clear()


@dataclass(eq=False)
class FlashState(Tracker):
    """The settings in flash memory, as far as known (RC-420 manual 18), and its positions.

    Nothing can ask a controller for it. But power-on loads the settings from flash memory, and FIS writes
    them there: from then on a setting is the same in both until it is set.
    """

    known: bool = False
    """True if power-on or FIS was seen, and nothing since that could change settings unseen."""
    positions: FlashPositions = field(default_factory=FlashPositions)
    _set: set[str] = field(default_factory=set)
    """Settings that were set since, by the first two characters of the commands."""
    _replies: dict[str, Reply] = field(default_factory=dict)
    """Answers from the time when both memories held the same, by the texts of their questions."""
    _shares: set[tuple[str, int | None]] = field(default_factory=set)
    """The shares that were set since the power came on, by their codes and sets."""

    def sent(self, command: RorzeCommand[Any], *, is_known: bool) -> None:
        """Note what may differ between both memories from now on."""
        if not is_known or type(command) in _UNSEEN:
            self.forget()
        elif command.effect is Effect.SETTING:
            self._set.add(command.code[:2])

    def done(self, command: RorzeCommand[Any], *, certain: bool) -> None:
        """Note that both memories hold the same, or may."""
        if type(command) is SaveSettings:
            self.forget()
            self.known = certain
        elif certain and isinstance(command, SHARES):
            self._shares.add((command.code, command.speed_set))

    def replied(self, question: RorzeCommand[Any], reply: Reply, at: float) -> None:  # noqa: ARG002
        """Take a setting that is the same in both."""
        if not self.known or question.effect is not Effect.READ:
            return
        kind = question.code[:2]
        if kind not in self._set and KEPT.fullmatch(kind):
            self._replies[_text(question)] = reply

    def powered_on(self, *, certain: bool) -> None:
        """The controller has loaded its settings."""
        self.forget()
        self._shares.clear()
        self.known = certain

    def forget(self) -> None:
        """Forget what flash memory holds of settings."""
        self.known = False
        self._set.clear()
        self._replies.clear()

    def may_be_unset(self, command: RorzeCommand[Any]) -> bool:
        """True if reading back what a command sets proves nothing: 0 % of a set, perhaps never set.

        The standard set leaves the factory with 50 % (RC-420 manual 18).
        """
        return (
            isinstance(command, SHARES)
            and command.speed_set is not None
            and command.percent == 0
            and (command.code, command.speed_set) not in self._shares
        )

    def held(self, question: RorzeCommand[Any]) -> Reply | None:
        """The answer of flash memory to a question; None where that is not known."""
        return self._replies.get(_text(question))


def _text(question: RorzeCommand[Any]) -> str:
    return question.code + question.written()


# its sensors and inputs

INPUTS: Final = range(10)


@dataclass(eq=False)
class SensorEdges(Tracker):
    """The sensors and inputs of one body as they were last told; the first telling is no edge."""

    _input_names: Mapping[int, str]
    _tell: Tell
    _sensors: int | None = field(default=None, init=False)
    _inputs: int | None = field(default=None, init=False)

    def replied(self, question: RorzeCommand[Any], reply: Reply, at: float) -> None:  # noqa: ARG002
        """It has answered a question for all of them (CLD, CID)."""
        if type(reply) is Sensors and reply.bits is not None:
            self._saw_sensors(reply.bits)
        elif type(reply) is Inputs and reply.bits is not None:
            self._saw_inputs(reply.bits)

    def reported(self, fields: Mapping[str, int]) -> None:
        """It has reported a change unasked (frame 7E)."""
        if "S" in fields:
            self._saw_sensors(fields["S"])
        if "I" in fields:
            self._saw_inputs(fields["I"])

    def _saw_sensors(self, bits: int) -> None:
        before, self._sensors = self._sensors, bits
        for number in _changed(before, bits, range(len(SENSOR_BITS))):
            on = bool(bits >> number & 1)
            self._tell("body.sensor.changed", {"sensor": SENSOR_BITS[number], "on": on})

    def _saw_inputs(self, bits: int) -> None:
        before, self._inputs = self._inputs, bits
        for number in _changed(before, bits, INPUTS):
            name, on = self._input_names.get(number), bool(bits >> number & 1)
            self._tell("body.input.changed", {"number": number, "name": name, "on": on})


def _changed(before: int | None, now: int, numbers: range) -> list[int]:
    return [] if before is None else [number for number in numbers if (before ^ now) >> number & 1]
