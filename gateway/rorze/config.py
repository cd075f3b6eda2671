"""The configuration of a line with an RC-400: its bodies and groups."""

import re
from collections.abc import Iterable, Iterator, Sequence
from math import ceil
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, PlainValidator, model_validator
from typing_extensions import TypeAliasType

from gateway.core import tables
from gateway.core.tables import Array, Fault, Name, Table, Weakness, refuse_repeats
from gateway.rorze.units import Scale
from protocols.rorze.link import HalfCommandEnd, frame
from protocols.rorze.link_master import MOST_MEMBERS
from protocols.rorze.modes import EventMask, StatusKind
from protocols.rorze.row import FIRST_GROUP, LAST_BODY, LAST_GROUP, LINK_MASTER
from protocols.rorze.status import CONTROLLER_STATUS_BITS, END_CAUSE_BITS, SENSOR_BITS


def _hex_between(lowest: int, highest: int) -> AfterValidator:
    def canonical(text: str) -> str:
        if not re.fullmatch("[0-9A-Fa-f]{2}", text) or not lowest <= int(text, 16) <= highest:
            raise ValueError(f"must be two hex digits from {lowest:02X} to {highest:02X}, not {text!r}")
        return text.upper()

    return AfterValidator(canonical)


def _check_pipeline(value: int) -> int:
    if value != 1:
        raise ValueError(
            "must be 1: replies carry no number, so with a second command under way"
            " a late reply could be credited to the wrong one"
        )
    return value


LAST_COMMENT = 7
"""User comments of a controller (RC-420 manual 14, 9VS)."""

BodyId = Annotated[str, _hex_between(0, LAST_BODY)]
GroupId = Annotated[str, _hex_between(FIRST_GROUP, LAST_GROUP)]


class UnitsTable(Table, Scale):
    """How pulses of a body relate to a physical unit."""


def _one_of(*names: str) -> AfterValidator:
    def known(name: str) -> str:
        if name not in names:
            raise ValueError(f"must be one of {', '.join(names)}, not {name!r}")
        return name

    return AfterValidator(known)


class Events(Table):
    """The changes that a body reports unasked (RC-420 manual 13.11)."""

    status: Array[Annotated[str, _one_of(*CONTROLLER_STATUS_BITS[1:])]] = ()
    """Errors of the controller status that rise."""
    end_causes: Array[Annotated[str, _one_of(*END_CAUSE_BITS)]] = ()
    """Causes of the end of moves that rise."""
    sensors: Array[Annotated[str, _one_of(*SENSOR_BITS)]] = ()
    """Sensors that change."""
    inputs: Array[Annotated[int, Field(ge=0, le=9)]] = ()
    """General inputs that change."""
    position: bool = False
    """True if they tell the position, too."""

    @property
    def mask(self) -> EventMask:
        """The mask that EMS is told."""
        return EventMask(
            controller=_bits(self.status, CONTROLLER_STATUS_BITS),
            end_cause=_bits(self.end_causes, END_CAUSE_BITS),
            sensors=_bits(self.sensors, SENSOR_BITS),
            inputs=sum({1 << number for number in self.inputs}),
        )

    @property
    def kinds(self) -> list[StatusKind]:
        """The kinds of status that ESS is told, in the order C, M, S, I, P."""
        mask = self.mask
        chosen: dict[StatusKind, object] = {
            "controller": mask.controller,
            "end_cause": mask.end_cause,
            "sensors": mask.sensors,
            "inputs": mask.inputs,
            "position": self.position,
        }
        return [kind for kind, wanted in chosen.items() if wanted]


def _bits(names: Iterable[str], known: Sequence[str]) -> int:
    return sum({1 << known.index(name) for name in names})


def _check_comment(number: object) -> int:
    if number is False:
        return 0
    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number <= LAST_COMMENT:
        raise ValueError(f"must be from 1 to {LAST_COMMENT}, or 0 or false for none")
    return number


class BodyTable(Table):
    """A controller on a line."""

    id: BodyId
    """Setting of the rotary switches, 00-77 hex (RC-420 manual 2.2)."""
    name: Name | None = None
    units: UnitsTable | None = None
    inputs: dict[str, Name] | None = None
    """Names of the inputs 0-9."""
    outputs: dict[str, Name] | None = None
    """Names of the outputs 0-15."""
    position_tolerance: int = Field(0, ge=0, le=1_000_000)
    """Pulses by which a move may miss its target in encoder mode, where the motor need not stop exactly at it
    (RC-420 manual 13.7.5)."""

    in_position: bool = False
    """INP of a servo drive is wired: in servo mode a move has succeeded when that is on (17.4)."""
    power_comment: Annotated[int, PlainValidator(_check_comment)] = 7
    """User comment (9VS), 1-7, in which a mark tells that the power was kept; 0 or false: none."""
    events: Events | None = None
    """The changes it reports unasked; left out, its own settings stay as they are."""
    slow_pattern: int | None = Field(None, ge=0, le=29)
    """The acceleration pattern that the gateway may overwrite in RAM, with the speed set of its number, for
    moves with a `max_speed`; left out, 29, where it was never set otherwise."""
    needs_origin: bool = True
    """True if motions to places are refused after a loss of power until it is homed, or a person agrees."""

    silence_needs_acknowledgement: bool = False
    """Each silence counts as a loss of power, where the board keeps position and comments without power."""

    @property
    def input_names(self) -> dict[int, str]:
        """By the numbers of the inputs."""
        return _numbered(self.inputs)

    @property
    def output_names(self) -> dict[int, str]:
        """By the numbers of the outputs."""
        return _numbered(self.outputs)

    @property
    def number(self) -> int:
        """The body number as it is, 0-119."""
        return int(self.id, 16)

    @model_validator(mode="after")
    def _name_what_is_there(self) -> Self:
        for names, last in ("inputs", 9), ("outputs", 15):
            for number in getattr(self, names) or ():
                if not re.fullmatch("0|[1-9][0-9]?", number) or int(number) > last:
                    raise Fault(f"must be from 0 to {last}, not {number!r}", names, number)
        return self


def _numbered(names: dict[str, str] | None) -> dict[int, str]:
    return {int(number): name for number, name in (names or {}).items()}


class GroupTable(Table):
    """A virtual body: a command to it goes to all members at once (RC-420 manual 12)."""

    id: GroupId
    members: Array[BodyId]
    """Members in the order in which they are sent to the link master."""

    @property
    def number(self) -> int:
        """The virtual body number as it is, 128-158."""
        return int(self.id, 16)

    @model_validator(mode="after")
    def _fit_the_frame_that_defines_it(self) -> Self:
        if len(self.members) < 2:
            raise Fault("must name at least 2 bodies", "members")
        refuse_repeats(self.members, "members")
        try:
            frame(LINK_MASTER, f"XVS{','.join((self.id, *self.members))}")
        except ValueError as error:
            raise Fault(f"names too many bodies for one definition: {error}", "members") from error
        return self


StopTiming = TypeAliasType("StopTiming", Literal["interject", "after_reply"])


class RorzeLineTable(tables.LineTable):
    """A port with a link master and its bodies behind it."""

    introducer: Literal["&", "$", "#"] = "&"
    """The first character of a command; after `$` and `#` a body number has one digit (RC-420 manual 12)."""
    pipeline: Annotated[int, AfterValidator(_check_pipeline)] = 1
    stop_mode: StopTiming = "interject"
    """True if a stop is sent at once or, should the link master not take it, after the reply under way."""
    half_commands: HalfCommandEnd = "overlong"
    """The end of a half command that an earlier life may have left, told when the port is opened."""
    port_baud: int = Field(9600, ge=50, le=4_000_000)
    """Speed of the serial port behind a terminal server; frames behind unanswered ones are spaced by it."""
    bodies: Array[BodyTable] = ()
    groups: Array[GroupTable] = ()
    health_share: float = Field(0.1, ge=0.01, le=0.5)
    """Share of the line's time that the questions how bodies are may take, where there are many."""
    move_samples_per_s: float = Field(0, ge=0, le=50)
    """Positions that are read of a body while it moves, and kept with the move; 0: only those read anyway."""
    sweep_groups: Array[GroupId] = ()
    """First and last number of the virtual bodies the gateway defines for itself, to ask many at once."""

    @model_validator(mode="after")
    def _be_consistent(self) -> Self:
        refuse_repeats([body.id for body in self.bodies], "bodies", key="id")
        refuse_repeats([group.id for group in self.groups], "groups", key="id")
        self._need_room_for_sweeps()
        if self.introducer != "&":
            self._need_one_digit_bodies()
        bodies = {body.id for body in self.bodies}
        for index, group in enumerate(self.groups):
            for position, member in enumerate(group.members):
                if member not in bodies:
                    raise Fault(
                        f"{member} is no body of line {self.id}", "groups", index, "members", position
                    )
        return self

    def served(self) -> str:
        """Its bodies and groups."""
        bodies = ", ".join(tables.named(body.id, body.name) for body in self.bodies) or "none"
        groups = "".join(f"; group {group.id} of {', '.join(group.members)}" for group in self.groups)
        return f"RC-400: bodies {bodies}{groups}"

    def weakened(self) -> Iterator[Weakness]:
        """Weak settings that would let a body go to places that are elsewhere."""
        for body in self.bodies:
            place = f"lines.{self.id}.bodies.{body.id}"
            if not body.power_comment:
                yield Weakness(f"{place}.power_comment", 0, "No mark tells of a loss of power.")
            if not body.needs_origin:
                meaning = "It moves to places after a loss of power, though they may be elsewhere."
                yield Weakness(f"{place}.needs_origin", False, meaning)

    @property
    def sweep_numbers(self) -> range:
        """The virtual bodies that the gateway may define for itself."""
        if not self.sweep_groups:
            return range(0)
        first, last = (int(number, 16) for number in self.sweep_groups)
        return range(first, last + 1)

    def _need_room_for_sweeps(self) -> None:
        if not self.sweep_groups:
            return
        if len(self.sweep_groups) != 2 or self.sweep_groups[0] > self.sweep_groups[1]:
            raise Fault('must be the first and the last number, such as ["90", "9E"]', "sweep_groups")
        taken = [group.id for group in self.groups if group.number in self.sweep_numbers]
        if taken:
            raise Fault(f"must leave out {', '.join(taken)}, which groups of the line have", "sweep_groups")
        needed = ceil(len(self.bodies) / MOST_MEMBERS)
        if len(self.sweep_numbers) < needed:
            raise Fault(f"must be at least {needed} numbers for {len(self.bodies)} bodies", "sweep_groups")

    def _need_one_digit_bodies(self) -> None:
        if self.groups or self.sweep_groups:
            where = "groups" if self.groups else "sweep_groups"
            raise Fault(f'cannot be addressed after {self.introducer!r}; use introducer = "&"', where)
        for index, body in enumerate(self.bodies):
            if body.number > 0xF:
                raise Fault(
                    f"must be from 00 to 0F on a line with introducer {self.introducer!r}, not {body.id!r}",
                    *("bodies", index, "id"),
                )
