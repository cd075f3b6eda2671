"""All that a body keeps: read from it, written as text, read from a text, compared (RC-420 manual 18)."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

from gateway.core.backup_text import Line, Part, commented, parts_of, refuse, section
from gateway.core.errors import ControllerRefused, Misplaced
from gateway.core.restore_record import Difference
from gateway.rorze import stored_program
from gateway.rorze.backup_places import (
    PLACES_OF,
    RAM_ONLY,
    SECTIONS,
    Command,
    Place,
    Section,
    normal,
    place_of,
    words_of,
)
from gateway.rorze.bodies import Body
from gateway.rorze.power import is_mark
from protocols.rorze.commands import COMMANDS
from protocols.rorze.inputs_outputs import SetErrorOutput, SetInterruptAction, SetInterruptMode
from protocols.rorze.patterns import SetPattern, SetSpeedChange
from protocols.rorze.position_table import SetPositionEntry
from protocols.rorze.speeds import SpeedSetting
from protocols.rorze.status import GetInformation, SetUserComment
from protocols.rorze.user_program.assembler import Assembled, assemble
from protocols.table import WireFault

KIND = "body"
NOT_THERE: Final = {"0x61"}
"""The refusal of what the operating mode does not have."""
NO_PATTERN: Final = {"0x47"}
PREAMBLE = (
    "; Backup of motion controllers. Restore it by `motion-gateway restore TARGET FILE`.\n"
    "; Each section is complete: what it does not name is empty, 0 or was never set.\n"
    "; A section that is taken out is left as it is by a restore.\n"
)

OnRead = Callable[[], None]


@dataclass
class Contents:
    """What a body keeps, or should."""

    places: dict[Section, dict[str, Command]] = field(default_factory=dict)
    """By section and by place, the commands that set it."""
    program: Assembled | tuple[str, ...] | None = None
    """None where it is not among the sections."""
    unread: list[str] = field(default_factory=list)
    """What the body has refused to tell, and why."""

    @property
    def sections(self) -> list[Section]:
        """The sections it has, in their order."""
        return [it for it in SECTIONS if it in self.places or (it == "program" and self.program is not None)]

    @property
    def instructions(self) -> tuple[str, ...]:
        """The program as the body stores it."""
        return self.program.texts() if isinstance(self.program, Assembled) else self.program or ()

    def lasting(self) -> "Contents":
        """The same without what is gone with the power."""
        lasting: dict[Section, dict[str, Command]] = {
            section: {key: it for key, it in commands.items() if not isinstance(it, RAM_ONLY)}
            for section, commands in self.places.items()
            if section != "memories"
        }
        return Contents(lasting, self.program)


# from a body


async def read(body: Body, sections: Iterable[Section], on_read: OnRead = lambda: None) -> Contents:
    """Read sections of a body, one question after the other.

    :raises GatewayError: one was not answered.
    """
    found = Contents()
    for name in sections:
        if name == "program":
            found.program = tuple(await stored_program.read_instructions(body))
        else:
            found.places[name] = await _Reading(body, found.unread, on_read).section(name)
    return found


@dataclass
class _Reading:
    body: Body
    unread: list[str]
    on_read: OnRead
    found: dict[str, Command] = field(default_factory=dict)

    async def section(self, name: Section) -> dict[str, Command]:
        """Read all places of a section that can hold something."""
        for key, place in PLACES_OF[name].items():
            if self._may_be_set(place) and (command := await self._at(place)) is not None:
                self.found[key] = command
            self.on_read()
        return self.found

    def _may_be_set(self, place: Place) -> bool:
        """A pattern that was never set has no speed changes, and a speed set without speeds no shares."""
        if place.row is SetSpeedChange:
            return Place(SetPattern, {"pattern": place.at["pattern"]}).key in self.found
        if place.row.code in ("OAS", "OBS"):
            return any(Place(COMMANDS[it], place.at).key in self.found for it in ("OLS", "OHS", "OSS"))
        return True

    async def _at(self, place: Place) -> Command | None:
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
        """Whether it is the comment by which the gateway sees a loss of power."""
        if not isinstance(command, SetUserComment):
            return False
        return command.comment_number == self.body.power.comment and is_mark(command.text)


# as text


async def text_of(body: Body, sections: Iterable[Section] = SECTIONS) -> str:
    """Read a body and write what it keeps.

    :raises GatewayError: it was not read.
    """
    version, _ = await body.ask(GetInformation())
    contents = await read(body, sections)
    named = f" ({body.name})" if body.name else ""
    return f"\n; /bodies/{body.address}{named}, {version.text}\n{written(body, contents)}"


def written(body: Body, contents: Contents) -> str:
    """Contents as text."""
    unread = "".join(f"; Not read: {it}\n" for it in contents.unread)
    return f"[{KIND} {body.short}]\n{unread}" + "".join(
        section(name, _program(contents) if name == "program" else _commands(body, contents.places[name]))
        for name in contents.sections
    )


def _program(contents: Contents) -> Iterator[str]:
    yield stored_program.StoredProgram(contents.instructions, 0, running=False).source


def _commands(body: Body, commands: Mapping[str, Command]) -> Iterator[str]:
    for command in commands.values():
        text = f"{command.code}{command.written()}"
        yield f"{text}\n" if isinstance(command, SetUserComment) else commented(text, _comment(body, command))


def _comment(body: Body, command: Command) -> str:
    if isinstance(command, SetPositionEntry) and body.scale is not None:
        return f"{body.scale.value(command.pulses or 0):g} {body.scale.unit}"
    return "pulses" if isinstance(command, SetPositionEntry) else words_of(type(command))


def parse(text: str) -> dict[int, Contents]:
    """Read a backup: what it has of each body, by its number.

    :raises InvalidText: it has faults, each with its line and column.
    """
    faults: list[Misplaced] = []
    found: dict[int, Contents] = {}
    for part in parts_of(text, KIND):
        try:
            number = int(part.name, 16)
        except ValueError:
            faults.append(Misplaced(part.line, 1, f"{part.name!r} is no body number."))
        else:
            found[number] = _contents(part, faults)
    refuse(sorted(faults))
    return found


def _contents(part: Part, faults: list[Misplaced]) -> Contents:
    contents = Contents()
    for name in SECTIONS:
        lines = part.sections.get(name)
        if lines is not None and name == "program":
            contents.program = _assembled(lines, faults)
        elif lines is not None:
            contents.places[name] = _parsed(name, lines, faults)
    faults += [
        Misplaced(part.line, 1, f"There is no section [{unknown}]: {', '.join(SECTIONS)}.")
        for unknown in part.sections.keys() - set(SECTIONS)
    ]
    return contents


def _assembled(lines: list[Line], faults: list[Misplaced]) -> Assembled | tuple[str, ...]:
    program = assemble("\n".join(line.text for line in lines))
    if isinstance(program, Assembled):
        return program
    faults += [Misplaced(lines[it.line - 1].number, it.column, it.reason) for it in program]
    return ()


def _parsed(name: Section, lines: Iterable[Line], faults: list[Misplaced]) -> dict[str, Command]:
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
    # In the order of the places, whatever that of the lines is; what is empty is not named.
    return {
        key: found[key] for key, it in PLACES_OF[name].items() if key in found and found[key] != it.emptied
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
    """What a body holds otherwise than a backup has it."""
    found = []
    for name in wanted.places:
        for key, place in PLACES_OF[name].items():
            should, does = wanted.places[name].get(key), held.places[name].get(key)
            if should != does:
                found.append(
                    Difference(
                        target=body_id,
                        section=name,
                        name=words_of(place.row),
                        wanted=_text(should),
                        held=_text(does),
                        restorable=should is not None or place.can_be_emptied,
                    )
                )
    if wanted.program is not None:
        found += _program_differences(body_id, wanted.instructions, held.instructions)
    return found


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


def commands(wanted: Contents, held: Contents) -> list[Command]:
    """The commands that make a body hold what a backup has; what was never set cannot be unset."""
    return [it for name in wanted.places for it in _of_section(name, wanted.places[name], held.places[name])]


def _of_section(
    name: Section, wanted: Mapping[str, Command], held: Mapping[str, Command]
) -> Iterator[Command]:
    places = PLACES_OF[name]
    differing = {key: it for key, it in places.items() if wanted.get(key) != held.get(key)}
    # An error output that another cause still has is refused.
    for key, place in differing.items():
        if place.row is SetErrorOutput and key in held and place.emptied is not None:
            yield place.emptied
    # SES takes all changes of a pattern away, never a single one.
    cleared = {it.at["pattern"] for key, it in differing.items() if it.row is SetSpeedChange and key in held}
    yield from (SetSpeedChange(pattern=int(str(pattern))) for pattern in sorted(cleared, key=str))
    # CPS takes the actions of its input away.
    armed = {it.at["port"] for it in differing.values() if it.row is SetInterruptMode}
    for key, place in places.items():
        undone = (place.row is SetSpeedChange and place.at["pattern"] in cleared and key in wanted) or (
            place.row is SetInterruptAction and place.at["port"] in armed
        )
        if key not in differing and not undone:
            continue
        command = wanted.get(key) or (None if place.row is SetErrorOutput else place.emptied)
        if command is not None and not (isinstance(command, SpeedSetting) and key not in wanted):
            yield command
