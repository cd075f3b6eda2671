"""The instruction at one address of a user program, read from its text and checked (RC-420 manual 15.2.3)."""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Annotated, Any

from pydantic import TypeAdapter, ValidationError

from protocols.rorze.commands import COMMANDS, Row
from protocols.rorze.notation import PositionWire
from protocols.rorze.programs import LABEL, STEPS
from protocols.rorze.row import RorzeCommand
from protocols.rorze.user_program.operands import DATA_MEMORY, BankPlace, Operand, OutOfRange, memory_in
from protocols.rorze.user_program.operations import OPERATIONS, OperandForm, OperationRow
from protocols.table import Choice, RangeFault, TextForm, Wire, WireFault, wire_of
from protocols.wording import sentence

LONGEST_INSTRUCTION = 32
LONGEST_LABEL = 13

_MEMORY = rf"(?<![0-9A-Z]){DATA_MEMORY}(?![0-9A-Z])"

_UNSTORABLE = "[^!-~]|[#$&]"
"""The three would begin a frame."""

COMMAND_STEPS = 3
"""An assumption, for labels too: the manual counts operations only, and calls this the average (15.2.4)."""


class InstructionFault(ValueError):
    """A text that is no instruction: what is wrong, and at which character, from 0."""

    def __init__(self, at: int, reason: str) -> None:
        super().__init__(reason)
        self.at = at
        self.reason = reason


@dataclass(frozen=True, slots=True)
class Label:
    """A name for the address after it; it does nothing."""

    text: str
    steps: int = COMMAND_STEPS

    @property
    def name(self) -> str:
        """The label without its `*`."""
        return self.text[1:]


@dataclass(frozen=True, slots=True)
class ProgramOperation:
    """One of the thirty commands that only programs know."""

    text: str
    row: OperationRow = field(compare=False, repr=False)
    operands: tuple[Operand, ...]
    steps: int

    @property
    def code(self) -> str:
        """Code of two or three letters."""
        return self.row.code


@dataclass(frozen=True, slots=True)
class Communication:
    """A command a host could send; data memories may stand for its numbers (15.2.5)."""

    text: str
    row: Row = field(compare=False, repr=False)
    parameters: tuple[tuple[str, str], ...]
    """Fields as written; empty where no memory stands for any of them."""
    steps: int = COMMAND_STEPS

    def command(self, number_in: Callable[[BankPlace], int]) -> RorzeCommand[Any]:
        """The command, with numbers for the memories.

        :raises WireFault: it has a number that the command cannot take.
        """
        if not self.parameters:
            return self.row.read(self.text[len(self.row.code) :])
        wires = _wires(self.row)
        values = {
            name: _decoded(self.row, name, _filled(text, wires[name], number_in))
            for name, text in self.parameters
        }
        try:
            return self.row.model_validate(values)
        except ValidationError as error:
            raise RangeFault(f"{self.text}: {sentence(error.errors()[0])}") from None


Instruction = Label | ProgramOperation | Communication


@lru_cache(maxsize=STEPS)
def parse(text: str) -> Instruction:
    """Read an instruction without blanks, as UWS takes it.

    :raises InstructionFault: no program can hold it.
    """
    if len(text) > LONGEST_INSTRUCTION:
        raise InstructionFault(
            LONGEST_INSTRUCTION,
            f"The instruction has {len(text)} characters, {LONGEST_INSTRUCTION} are allowed.",
        )
    if (wrong := re.search(_UNSTORABLE, text)) is not None:
        raise InstructionFault(wrong.start(), f"No instruction can have the character {wrong[0]!r}.")
    if text.startswith("*"):
        return _label(text)
    for length in (3, 2):
        if (row := OPERATIONS.get(text[:length])) is not None:
            return _operation(text, row)
    command = COMMANDS.get(text[:3])
    if command is None:
        raise InstructionFault(0, _no_command(text))
    if not command.program:
        raise InstructionFault(0, f"{command.code} cannot stand in a program.")
    return _communication(text, command)


def _no_command(text: str) -> str:
    for name in (text[:3], text[:2]):
        capital = name.upper()
        if capital != name and (capital in OPERATIONS or capital in COMMANDS):
            return f"{name!r} is no command. Commands are written in capitals."
    word = re.match(
        "[0-9]?[A-Za-z]+", text
    )  # blanks are gone: what stands behind a word may be its parameter
    return f"{(word[0] if word else text[:3])!r} is no command."


def _label(text: str) -> Label:
    if re.fullmatch(LABEL, text[1:]):
        return Label(text)
    wrong = re.search("[^0-9A-Za-z_]", text[1:])
    at = 1 + (wrong.start() if wrong else min(len(text) - 1, LONGEST_LABEL))
    raise InstructionFault(
        at, f"A label is * and 1 to {LONGEST_LABEL} letters, digits and underscores, which {text!r} is not."
    )


# Operations


@dataclass(frozen=True, slots=True)
class _Misfit(Exception):
    """An operand that a form cannot have: what it takes there, or why what stands there does not exist."""

    at: int
    takes: str
    reason: str = ""


def _operation(text: str, row: OperationRow) -> ProgramOperation:
    words = row.split(text[len(row.code) :])
    misfits = []
    for form in row.forms:
        try:
            return ProgramOperation(text, row, tuple(_operands(text, row, form, words)), form.steps)
        except _Misfit as misfit:
            misfits.append(misfit)
    # The form that fits furthest is the one that was meant.
    at = max(misfit.at for misfit in misfits)
    meant = [misfit for misfit in misfits if misfit.at == at]
    if reason := next((misfit.reason for misfit in meant if misfit.reason), ""):
        raise InstructionFault(at, f"{reason}.")
    takes = ", ".join(dict.fromkeys(misfit.takes for misfit in meant))
    raise InstructionFault(at, f"{row.code} takes here: {takes}.")


def _operands(
    text: str, row: OperationRow, form: OperandForm, words: list[tuple[int, str]]
) -> Iterator[Operand]:
    """The operands of a form.

    :raises _Misfit: the text has others.
    """
    for place, kind in enumerate(form.kinds):
        start, word = words[place] if place < len(words) else (len(text) - len(row.code), "")
        at = len(row.code) + start
        try:
            operand = kind.read(word)
        except OutOfRange as fault:
            raise _Misfit(at, kind.words, str(fault)) from None
        if operand is None:
            raise _Misfit(at, kind.words)
        yield operand
    if len(words) > len(form.kinds):
        raise _Misfit(len(row.code) + words[len(form.kinds)][0], "nothing more")


# Commands


def _communication(text: str, row: Row) -> Communication:
    written = text[len(row.code) :]
    if re.search(_MEMORY, written) is None:
        return _without_memories(text, row)
    for form in _program_forms(row):
        parameters = form.read(written)
        if parameters is not None:
            texts = {name: str(value) for name, value in parameters.items()}
            _check_parameters(text, row, texts)
            return Communication(text, row, tuple(texts.items()))
    return _without_memories(text, row)


def _without_memories(text: str, row: Row) -> Communication:
    try:
        row.read(text[len(row.code) :])
    except WireFault as fault:
        raise InstructionFault(len(row.code), f"{row.code} cannot have these parameters: {fault}.") from None
    return Communication(text, row, ())


def _check_parameters(text: str, row: Row, parameters: Mapping[str, str]) -> None:
    """See that every memory exists, and that the numbers beside them are in their ranges."""
    for name, written in parameters.items():
        try:
            memories = [memory_in(found) for found in re.findall(_MEMORY, written)]
            if not memories:
                _decoded(row, name, written)
        except (OutOfRange, WireFault) as fault:
            raise InstructionFault(text.index(written, len(row.code)), f"{fault}.") from None


class _InProgram(Wire):
    """A parameter as it stands in a program, kept as text."""

    def __init__(self, pattern: str) -> None:
        self.pattern = pattern


@lru_cache
def _wires(row: Row) -> Mapping[str, Wire]:
    return {name: wire_of(each.annotation, each.metadata) for name, each in row.model_fields.items()}


@lru_cache
def _program_forms(row: Row) -> tuple[TextForm, ...]:
    """The forms of a command, with data memories wherever it takes a number."""
    wires = {name: _InProgram(_pattern_in_program(wire)) for name, wire in _wires(row).items()}
    return tuple(TextForm(form.syntax, wires) for form in row.forms)


_NUMBERS = ("0", "1", "2", "0.00", *("H" + "0" * digits for digits in range(1, 9)))


def _pattern_in_program(wire: Wire) -> str:
    if isinstance(wire, Choice):
        return "|".join(map(_pattern_in_program, wire.wires))
    if isinstance(wire, PositionWire):
        return rf"P\[{DATA_MEMORY}\]|{wire.pattern}"
    takes_numbers = any(re.fullmatch(wire.pattern, number) for number in _NUMBERS)
    return f"{DATA_MEMORY}|{wire.pattern}" if takes_numbers else wire.pattern


def _filled(text: str, wire: Wire, number_in: Callable[[BankPlace], int]) -> str:
    """A parameter with numbers for its memories, written as the parameter demands: in decimal or as bits."""

    def number(match: re.Match[str]) -> str:
        memory = memory_in(match[0])
        return match[0] if memory is None else str(number_in(memory))

    filled = re.sub(_MEMORY, number, text)
    if re.fullmatch(wire.pattern, filled) is None and filled.isdecimal():
        return Choice((wire,)).encode(int(filled))
    return filled


@lru_cache
def _field(row: Row, name: str) -> TypeAdapter[object]:
    found = row.model_fields[name]
    annotation: Any = Annotated[found.annotation, found]
    return TypeAdapter(annotation)


def _decoded(row: Row, name: str, text: str) -> object:
    """The value of a field.

    :raises WireFault: it cannot be so.
    """
    wire = _wires(row)[name]
    if re.fullmatch(wire.pattern, text) is None:
        raise RangeFault(f"{row.code} cannot take {text} for its {name}")
    try:
        value: object = wire.decode(text)
        return _field(row, name).validate_python(value, strict=True)
    except ValidationError as error:
        why = sentence(error.errors()[0])
        raise RangeFault(f"{row.code} cannot take {text} for its {name}: {why}") from None
