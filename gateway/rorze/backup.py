"""All that a body keeps: read from it, written as text, read from a text, compared (RC-420 manual 18)."""

import asyncio
import re
from collections import deque
from collections.abc import Awaitable, Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import partial
from typing import Final, TypeVar

from pydantic import ValidationError

from gateway.core.backup_record import Difference, ScaleDifference, Units
from gateway.core.backups import BackupLine, BackupPart, commented, parts_of, refuse, section
from gateway.core.errors import BodyBusy, ControllerRefused, InvalidRequest, Misplaced
from gateway.core.exchange import Lane
from gateway.core.readings import ProgressListener
from gateway.rorze import stored_program
from gateway.rorze.asked_body import is_mark
from gateway.rorze.backup_places import (
    PLACES,
    PLACES_OF,
    RAM_ONLY,
    SECTIONS,
    BackupPlace,
    Command,
    Section,
    given,
    normal,
    place_of,
    words_of,
)
from gateway.rorze.bodies import Body
from gateway.rorze.knowledge import SHARES
from gateway.rorze.units import Scale
from protocols.rorze import encoder, inputs_outputs, interpolation, modes, origin, patterns, speeds
from protocols.rorze.commands import COMMANDS, Row
from protocols.rorze.inputs_outputs import SetErrorOutput, SetInterruptAction, SetInterruptMode
from protocols.rorze.modes import SetOperatingMode
from protocols.rorze.notation import BILLION, PositionReference
from protocols.rorze.patterns import SetPattern, SetSpeedChange
from protocols.rorze.position_table import SetPositionEntry
from protocols.rorze.programs import GetLastProgramAddress, SetProgramMemory
from protocols.rorze.speeds import (
    SetMaximumAcceleration,
    SetMaximumSpeed,
    SetStartSpeed,
)
from protocols.rorze.stall_sensor import SetStallSensorInterval
from protocols.rorze.status import GetInformation, SetUserComment
from protocols.rorze.user_program.assembler import Assembled, assemble
from protocols.table import WireFault

T = TypeVar("T")

KIND = "body"
AHEAD = 2
"""Questions in flight: enough to keep the line busy, few enough not to delay other readers of the body."""
SPEEDS = (SetStartSpeed, SetMaximumSpeed, SetMaximumAcceleration)
READINGS = 4
"""Readings of a value that changes each time; the last one is told."""
NOT_THERE: Final = {"0x61"}
"""The refusal of what the operating mode does not have."""
NO_PATTERN: Final = {"0x47"}
PREAMBLE = (
    "; Backup of motion controllers. Restore it by `motion-gateway restore TARGET FILE`.\n"
    "; A section, or a line of [settings], that is taken out is left as it is by a restore.\n"
    "; All other sections are tables: what they do not name is 0, or was never set.\n"
)

OnRead = Callable[[], None]
Names = Mapping[int, str]
"""Names of positions, by their numbers."""
NO_NAMES: Final[Names] = {}
SCALE: Final = "scale"
"""The section that tells how many pulses a unit is."""
_SCALE: Final = re.compile(r"([0-9]+(?:\.[0-9]+)?) pulses/([a-z]+)")


@dataclass
class Contents:
    """The content of a body, or of a backup of it."""

    places: dict[Section, dict[str, Command]] = field(default_factory=dict)
    """Commands that set each place, by section and by place."""
    program: Assembled | tuple[str, ...] | None = None
    """The user program; None where it is not among the sections."""
    unread: list[str] = field(default_factory=list)
    """The places that the body has refused to tell, and why."""
    scale: Scale | None = None
    """Scale of the pulses of lengths and angles at the time of the backup; None where nothing tells."""

    @property
    def sections(self) -> list[Section]:
        """The sections it has, in their order."""
        return [
            section
            for section in SECTIONS
            if section in self.places or (section == "program" and self.program is not None)
        ]

    @property
    def instructions(self) -> tuple[str, ...]:
        """The program as the body stores it."""
        return self.program.texts() if isinstance(self.program, Assembled) else self.program or ()

    @property
    def in_encoder_counts(self) -> bool:
        """True if its positions are encoder counts, as its settings tell (EAS)."""
        settings = self.places.get("settings", {}).values()
        return any(
            isinstance(setting, SetOperatingMode) and setting.mode == "encoder" for setting in settings
        )

    def without(self, sections: Collection[str]) -> "Contents":
        """Leave out sections, which a restore leaves as they are."""
        places = {name: commands for name, commands in self.places.items() if name not in sections}
        return replace(self, places=places, program=None if "program" in sections else self.program)

    def lasting(self) -> "Contents":
        """Leave out all that is gone with the power."""
        lasting: dict[Section, dict[str, Command]] = {
            section: {key: command for key, command in commands.items() if not isinstance(command, RAM_ONLY)}
            for section, commands in self.places.items()
            if section != "memories"
        }
        return Contents(lasting, self.program, scale=self.scale)


# from a body


async def read(body: Body, sections: Iterable[Section], on_read: OnRead = lambda: None) -> Contents:
    """Read sections of a body, one question after the other.

    :raises GatewayError: one was not answered.
    """
    found = Contents()
    async with body.looking():
        for name in sections:
            if name == "program":
                found.program = tuple(await stored_program.read_instructions(body, on_read))
            else:
                found.places[name] = await _Reading(body, found.unread, on_read).section(name)
    return found


def _depends(place: BackupPlace) -> bool:
    """True if what was read before decides whether it is asked for."""
    return place.row is SetSpeedChange or place.row in SHARES


@dataclass
class _Reading:
    body: Body
    unread: list[str]
    on_read: OnRead
    found: dict[str, Command] = field(default_factory=dict)

    async def section(self, name: Section) -> dict[str, Command]:
        """Read all places of a section that can hold something. The next question is at the line already."""
        asked: deque[tuple[str, asyncio.Task[Command | None]]] = deque()
        try:
            for key, place in PLACES_OF[name].items():
                while len(asked) >= (1 if _depends(place) else AHEAD):
                    await self._take(*asked.popleft())
                if self._may_be_set(place):
                    asked.append((key, asyncio.create_task(self.at(place))))
            while asked:
                await self._take(*asked.popleft())
        finally:
            for _, task in asked:
                task.cancel()
            await asyncio.gather(*(task for _, task in asked), return_exceptions=True)
        return self.found

    async def _take(self, key: str, answer: "asyncio.Task[Command | None]") -> None:
        command = await answer
        if command is not None:
            self.found[key] = command
        self.on_read()

    def _may_be_set(self, place: BackupPlace) -> bool:
        """A pattern that was never set has no speed changes, and a speed set without speeds no shares."""
        if place.row is SetSpeedChange:
            return BackupPlace(SetPattern, {"pattern": place.at["pattern"]}).key in self.found
        if place.row in SHARES:
            return any(BackupPlace(row, place.at).key in self.found for row in SPEEDS)
        return True

    async def at(self, place: BackupPlace) -> Command | None:
        """Read a place; None where nothing is set, or that may be told."""
        try:
            reply, _ = await self.body.ask(place.question)
        except ControllerRefused as refusal:
            if refusal.error_code not in NOT_THERE | (NO_PATTERN if place.row is SetPattern else set()):
                if not refusal.lasting:
                    raise
                self.unread.append(f"{place.key}: {refusal.detail}")
            return None
        command = place.setting(reply)
        return None if command is None or self._is_mark(command) else command

    def _is_mark(self, command: Command) -> bool:
        """True if it is the comment by which the gateway sees a loss of power."""
        if not isinstance(command, SetUserComment):
            return False
        return command.comment_number == self.body.power.mark.comment and is_mark(command.text)


async def confirm(body: Body, wanted: Contents, held: Contents) -> None:
    """Read what differs until two readings agree: one garbled digit proves nothing.

    :raises GatewayError: something was not answered.
    """
    reading = _Reading(body, held.unread, lambda: None)
    for name in wanted.places:
        for place in differing(name, wanted, held):
            told = held.places[name].pop(place.key, None)
            told = await _agreed(told, partial(reading.at, place))
            if told is not None:
                held.places[name][place.key] = told
    if wanted.program is not None and wanted.instructions != held.instructions:
        again = partial(stored_program.read_instructions, body)
        held.program = tuple(await _agreed(list(held.instructions), again))


async def _agreed(told: T, read_again: Callable[[], Awaitable[T]]) -> T:
    for _ in range(READINGS):
        before, told = told, await read_again()
        if told == before:
            break
    return told


# as text


async def text_of(body: Body, names: Names = NO_NAMES, on_read: OnRead = lambda: None) -> str:
    """Read a body and write what it keeps, with the names of its positions.

    :raises BodyBusy: it has lost its power meanwhile, so that not all was read of one state.
    :raises GatewayError: it was not read.
    """
    version, _ = await body.ask(GetInformation())
    losses = body.power.losses
    contents = await read(body, SECTIONS, on_read)
    contents.scale = body.scale
    if await body.mark.stands(Lane.READ) is False or body.power.losses != losses:
        raise BodyBusy(f"{body.address} has lost its power while it was read.", "Read the backup again.")
    named = f" ({body.configured.name})" if body.configured.name else ""
    return f"\n; /bodies/{body.address}{named}, {version.text}\n{written(body, contents, names)}"


@dataclass(frozen=True)
class BodySource:
    """A body that a backup is read from."""

    body: Body
    require_free: Callable[[], None]
    """Raises where its program, or all it keeps, is being changed."""
    names: Names
    """Names of its positions, by number."""

    @property
    def address(self) -> str:
        """Its unique address."""
        return self.body.address

    @property
    def baud(self) -> int | None:
        """The speed of its line; None where its port does not tell."""
        return self.body.line.baud

    async def require_ready(self) -> None:
        """Make sure that it answers and is not being changed; errors as of `text_of`."""
        self.require_free()
        await self.body.ask(GetInformation())

    async def read(self, progress: ProgressListener) -> str:
        """Read all that it keeps; errors as of `text_of`."""
        self.require_free()
        end, _ = await self.body.ask(GetLastProgramAddress())
        progress.expect(sum(map(len, PLACES_OF.values())) + end.address)
        return await text_of(self.body, self.names, progress.has_read)


def answers_of(contents: Contents) -> int:
    """Count the answers that reading the sections takes at most."""
    places = sum(len(PLACES_OF[name]) for name in contents.sections if name != "program")
    return places + len(contents.instructions)


def written(body: Body, contents: Contents, names: Names = NO_NAMES) -> str:
    """Contents as text."""
    unread = "".join(f"; Not read: {sentence}\n" for sentence in contents.unread)
    scale = "" if contents.scale is None else section(SCALE, [f"{contents.scale.words}\n"])
    return f"[{KIND} {body.short}]\n{unread}{scale}" + "".join(
        section(name, _lines(body, name, contents, names)) for name in contents.sections
    )


def _lines(body: Body, name: Section, contents: Contents, names: Names) -> Iterator[str]:
    if name == "program":
        yield stored_program.StoredProgram(contents.instructions, 0, running=False).source
    elif name == "positions":
        yield from _positions(body, contents, names)
    else:
        yield from map(_line, contents.places[name].values())


def _line(command: Command) -> str:
    text = f"{command.code}{command.written()}"
    return f"{text}\n" if isinstance(command, SetUserComment) else commented(text, words_of(type(command)))


def _positions(body: Body, contents: Contents, names: Names) -> Iterator[str]:
    """Lines of positions that are not 0 or have a name, each with its place in the body's unit and name."""
    pulses = {
        command.entry.position: command.pulses or 0
        for command in contents.places["positions"].values()
        if isinstance(command, SetPositionEntry) and isinstance(command.entry.position, int)
    }
    for number in sorted({*pulses, *names}):
        held = pulses.get(number, 0)
        command = SetPositionEntry(entry=PositionReference(position=number), pulses=held)
        comment = _place(body, contents, held) + (f", {names[number]}" if number in names else "")
        yield commented(f"{command.code}{command.written()}", comment)


def _place(body: Body, contents: Contents, pulses: int) -> str:
    if contents.in_encoder_counts:
        return "encoder counts"
    return "pulses" if body.scale is None else body.scale.written(pulses)


def parse(text: str) -> dict[int, Contents]:
    """Read a backup: what it has of each body, by its number.

    :raises InvalidText: it has faults, each with its line and column.
    """
    faults: list[Misplaced] = []
    found: dict[int, Contents] = {}
    for part in parts_of(text, KIND):
        if (number := body_number(part.name)) is None:
            faults.append(Misplaced(part.line, 1, f"{part.name!r} is no body number."))
        else:
            found[number] = _contents(part, faults)
    refuse(sorted(faults))
    return found


def body_number(text: str) -> int | None:
    """Read two hexadecimal digits; None where they are none of a body."""
    return int(text, 16) if re.fullmatch("[0-7][0-9A-Fa-f]", text, re.ASCII) else None


def _contents(part: BackupPart, faults: list[Misplaced]) -> Contents:
    contents = Contents(scale=_scale(part, faults))
    for name in SECTIONS:
        lines = part.sections.get(name)
        if lines is not None and name == "program":
            contents.program = _assembled(lines, faults)
        elif lines is not None:
            contents.places[name] = _parsed(name, lines, faults)
    faults += [
        Misplaced(line, 1, f"There is no section [{name}]; there are {', '.join(SECTIONS)}.")
        for name, line in part.headings.items()
        if name not in (SCALE, *SECTIONS)
    ]
    return contents


def _scale(part: BackupPart, faults: list[Misplaced]) -> Scale | None:
    """The scale of a part; None where it has none."""
    found = None
    for line in part.sections.get(SCALE, ()):
        text = line.text.partition(";")[0].strip()
        if not text:
            continue
        match = _SCALE.fullmatch(text)
        try:
            scale = (
                Scale.model_validate({"unit": match[2], "pulses_per_unit": float(match[1])})
                if match
                else None
            )
        except ValidationError:
            scale = None
        if scale is None or found is not None:
            faults.append(Misplaced(line.number, 1, "[scale] has one line, such as 100 pulses/mm."))
        found = scale
    return found


def _assembled(lines: list[BackupLine], faults: list[Misplaced]) -> Assembled | tuple[str, ...]:
    program = assemble("\n".join(line.text for line in lines))
    if isinstance(program, Assembled):
        return replace(program, lines=tuple(lines[line - 1].number for line in program.lines))
    faults += [Misplaced(lines[fault.line - 1].number, fault.column, fault.reason) for fault in program]
    return ()


def _parsed(name: Section, lines: Iterable[BackupLine], faults: list[Misplaced]) -> dict[str, Command]:
    found: dict[str, Command] = {}
    for line in lines:
        text = line.text.strip()
        if not text or text.startswith(";"):
            continue
        try:
            key, command = _setting(name, text)
        except ValueError as fault:
            faults.append(Misplaced(line.number, 1, str(fault)))
            continue
        if key in found:
            faults.append(Misplaced(line.number, 1, f"{text} sets the same as a line before it."))
        found[key] = command
    # In the order of the places, whatever that of the lines is; what is 0 is not named.
    return {
        key: found[key]
        for key, place in PLACES_OF[name].items()
        if key in found and found[key] != place.emptied
    }


def _setting(name: Section, text: str) -> tuple[str, Command]:
    """Read a line.

    :raises ValueError: it sets nothing of the section.
    """
    code = text[:3]
    row = COMMANDS.get(code)
    # A user comment may have blanks and a semicolon; all others may not.
    arguments = text[3:] if code == SetUserComment.code else "".join(text[3:].partition(";")[0].split())
    if row is None:
        raise ValueError(f"There is no command {code}.")
    try:
        command = normal(row.read(arguments))
    except WireFault as fault:
        raise ValueError(f"{code}: {fault}.") from None
    place = place_of(command)
    if place is None or place.key not in PLACES_OF[name]:
        raise ValueError(f"{code}{arguments} sets nothing that [{name}] has a line for.")
    return place.key, command


# compared


def differences(body_id: str, wanted: Contents, held: Contents) -> list[Difference]:
    """The differences between a body and a backup."""
    found = [
        Difference(
            target=body_id,
            section=name,
            name=words_of(place.row),
            wanted=_text(wanted.places[name].get(place.key)),
            held=_text(held.places[name].get(place.key)),
            restorable=place.key in wanted.places[name] or place.can_be_unset,
        )
        for name in wanted.places
        for place in differing(name, wanted, held)
    ]
    if wanted.program is not None:
        found += _program_differences(body_id, wanted.instructions, held.instructions)
    return found


def differing(name: Section, wanted: Contents, held: Contents) -> list[BackupPlace]:
    """The places of a section that are not as in a backup; settings that it does not name may be anything."""
    should, does = wanted.places[name], held.places[name]
    return [
        place
        for key, place in PLACES_OF[name].items()
        if should.get(key) != does.get(key)
        and (key in should or not (name == "settings" or place.is_always_set))
    ]


def _text(command: Command | None) -> str | None:
    return None if command is None else f"{command.code}{command.written()}"


def _program_differences(
    body_id: str, wanted: tuple[str, ...], held: tuple[str, ...]
) -> Iterator[Difference]:
    for address in range(max(len(wanted), len(held))):
        should = wanted[address] if address < len(wanted) else None
        does = held[address] if address < len(held) else None
        if should != does:
            yield Difference(
                target=body_id,
                section="program",
                name=f"address {address}",
                wanted=should,
                held=does,
                restorable=True,
            )


# written again


def commands(
    wanted: Contents, held: Contents, may_be_unset: Callable[[Command], bool] = lambda _: False
) -> list[Command]:
    """The commands that make a body hold a backup; a place that was never set cannot be unset.

    A place that reads equal already is left out, unless its command `may_be_unset`.
    """
    made: list[Command] = []
    for name in wanted.places:
        places = differing(name, wanted, held)
        places += [
            place
            for key, command in wanted.places[name].items()
            if may_be_unset(command) and (place := PLACES[key]) not in places
        ]
        write = _settings if name == "settings" else _table
        made += write(places, wanted.places[name], held.places[name])
    return made


def _settings(
    places: Iterable[BackupPlace], wanted: Mapping[str, Command], held: Mapping[str, Command]
) -> Iterator[Command]:
    """Free the error outputs that change, which are refused while another cause has them.

    CPS takes the actions of its input away, so that they are set again.
    """
    keys = {place.key for place in places}
    for command in (held.get(key) for key in keys & wanted.keys()):
        if isinstance(command, SetErrorOutput) and command.output is not None:
            yield SetErrorOutput(cause=command.cause)
    armed = {edge.port for key in keys if isinstance(edge := wanted[key], SetInterruptMode)}
    for key, command in wanted.items():
        if key in keys or (isinstance(command, SetInterruptAction) and command.port in armed):
            yield command


def _table(
    places: Iterable[BackupPlace], wanted: Mapping[str, Command], held: Mapping[str, Command]
) -> Iterator[Command]:
    """SES takes all changes of a pattern away, never a single one, so that the others are set again."""
    keys = {place.key for place in places}
    cleared = {old.pattern for key in keys if isinstance(old := held.get(key), SetSpeedChange)}
    yield from (SetSpeedChange(pattern=pattern) for pattern in sorted(cleared))
    for place in places:
        if place.key not in wanted and place.emptied is not None:
            yield place.emptied
    for key, command in wanted.items():
        if key in keys or (isinstance(command, SetSpeedChange) and command.pattern in cleared):
            yield command


# for a body whose pulses are of another length

IN_PULSES: Final[Mapping[Row, tuple[str, ...]]] = {
    SetPositionEntry: ("pulses",),
    modes.SetSoftLimits: ("lower", "upper"),
    inputs_outputs.SetInterruptRange: ("lower", "upper"),
    origin.SetOriginOffset: ("offset",),
    SetStallSensorInterval: ("interval",),
    encoder.SetEncoderStallThreshold: ("threshold",),
    encoder.SetEncoderRatio: ("ratio",),
    encoder.SetAdjustmentLimit: ("limit",),
    encoder.SetAdjustmentSpeed: ("speed",),
    interpolation.SetPulsesPerTurn: ("pulses",),
    speeds.SetStartSpeed: ("speed",),
    speeds.SetMaximumSpeed: ("speed",),
    speeds.SetMaximumAcceleration: ("acceleration",),
    patterns.SetSpeedChange: ("begin", "end", "speed"),
}
"""The fields that grow with the pulses a unit is. Percent, times and counts of tries do not."""
FARTHEST: Final = BILLION - 1
"""Bound that means none; as a place it is one."""


def for_body(wanted: Contents, body: Body, units: Units | None) -> tuple[Contents, ScaleDifference | None]:
    """Give what a body is to hold, and how its scale differs from that of the backup, if it does.

    A backup that does not tell its scale is taken as it is, and so is one for a body of the same scale.

    :raises InvalidRequest: the scales differ, and `units` does not say what to do, or it cannot be done.
    """
    if wanted.scale is None or _is_same(wanted.scale, body.scale):
        return wanted, None
    own = "no scale" if body.scale is None else body.scale.words
    differ = f"The backup was made at {wanted.scale.words}, and {body.address} has {own}"
    if units is None:
        raise InvalidRequest(
            f"{differ}: the same pulses would be other places; nothing was sent.",
            "Say `units`: keep_pulses restores the pulses as they are, convert keeps the lengths and speeds.",
        )
    found = ScaleDifference(target=body.address, backup=wanted.scale.words, controller=own, units=units)
    if units == "keep_pulses":
        return wanted, found
    factor = None if body.scale is None else body.scale.per(wanted.scale)
    if factor is None:
        raise InvalidRequest(f"{differ}: one is not converted to the other; nothing was sent.", TAKE_OUT)
    for why in _hindrances(wanted):
        raise InvalidRequest(f"{differ}: {why}; nothing was sent.", TAKE_OUT)
    return _converted(wanted, factor), found


TAKE_OUT: Final = "Take out what cannot be converted, or say `units`: keep_pulses."


def _is_same(one: Scale, other: Scale | None) -> bool:
    return other is not None and other.per(one) == 1


def _hindrances(wanted: Contents) -> Iterator[str]:
    """Why a backup is not converted: numbers whose unit is not known here, or that no scale converts."""
    if wanted.in_encoder_counts:
        yield "in encoder mode its positions are encoder counts (EAS), which are not converted"
    if wanted.instructions:
        yield "its [program] may have amounts in pulses, which are not converted"
    memories = wanted.places.get("memories", {}).values()
    if any(isinstance(command, SetProgramMemory) and command.memory[0] == "D" for command in memories):
        yield "data memories of [memories] may be amounts in pulses, which are not converted"


def _converted(wanted: Contents, factor: Fraction) -> Contents:
    places: dict[Section, dict[str, Command]] = {
        name: {key: _scaled(command, factor) for key, command in commands.items()}
        for name, commands in wanted.places.items()
    }
    return Contents(places, wanted.program)


def _scaled(command: Command, factor: Fraction) -> Command:
    """Scale a length or speed: to the nearest whole number of pulses, or of hundredths where it has decimals.

    :raises InvalidRequest: the controller does not take a value that large or that small.
    """
    fields = IN_PULSES.get(type(command), ())
    place = isinstance(command, SetPositionEntry)
    values = {
        name: value
        for name in fields
        if (value := getattr(command, name)) and (place or abs(value) < FARTHEST)
    }
    scaled = {
        name: round(value * factor)
        if isinstance(value, int)
        else round(float(Fraction(str(value)) * factor), 2)
        for name, value in values.items()
    }
    try:
        return normal(type(command)(**{**given(command), **scaled}))
    except ValidationError:
        text = f"{command.code}{command.written()}"
        told = ", ".join(f"{name} {value}" for name, value in scaled.items())
        raise InvalidRequest(
            f"{text} comes to {told}, which {command.code} does not take; nothing was sent.", TAKE_OUT
        ) from None
