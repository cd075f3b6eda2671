"""Program text to instructions and back: one instruction a line, comments after `;` (RC-420 manual 15.2)."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from protocols.rorze.programs import STEPS
from protocols.rorze.user_program.instruction import (
    Communication,
    Instruction,
    InstructionFault,
    Label,
    parse,
)
from protocols.rorze.user_program.operands import Offset, ToLabel

MOST_LABELS = 500

_BLANKS = " \t"
_MESSAGE_LINE = re.compile(rf"[{_BLANKS}]*SDC")
_COMMENT = re.compile(";.*")
_COMMENT_AFTER_MESSAGE = re.compile(rf"(?:^|(?<=[{_BLANKS}]));.*")


@dataclass(frozen=True, slots=True)
class ProgramFault:
    """A fault of a program text, and its place: line and column count from 1."""

    line: int
    column: int
    reason: str


@dataclass(frozen=True, slots=True)
class Assembled:
    """A program without faults."""

    instructions: tuple[Instruction, ...]
    """Instructions by address."""
    lines: tuple[int, ...]
    """The line of each address in the text, from 1."""
    labels: Mapping[str, int]
    """The address of each label."""
    steps: int

    def missing_end(self) -> ProgramFault | None:
        """Tell of a program that goes on behind its last instruction: to end normally it needs END there.

        A controller takes it, and ends it with an error (RC-420 manual 15.2.6).
        """
        if not self.instructions:
            return ProgramFault(1, 1, "The program is empty, and needs END to end normally.")
        last = self.instructions[-1]
        if not isinstance(last, Label | Communication) and last.code in _ENDS:
            return None
        return ProgramFault(
            self.lines[-1],
            1,
            "The program goes on behind its last instruction: it needs END there to end normally.",
        )

    def texts(self) -> tuple[str, ...]:
        """The instructions as UWS takes them and UWD tells them."""
        return tuple(instruction.text for instruction in self.instructions)


_ENDS = frozenset(("END", "JMP", "RET"))
"""Operations after which the next address is not executed."""


@dataclass(frozen=True, slots=True)
class _Line:
    """A line that has an instruction, without blanks and comment."""

    number: int
    text: str
    columns: tuple[int, ...]
    """Column of each of the text's characters."""

    def fault(self, at: int, reason: str) -> ProgramFault:
        """Make the fault at a character; after the last one, just behind it."""
        column = self.columns[at] if at < len(self.columns) else self.columns[-1] + 1
        return ProgramFault(self.number, column, reason)


def assemble(source: str) -> Assembled | tuple[ProgramFault, ...]:
    """Translate a program, or tell everything that is wrong with it, in the order of its lines.

    Blanks are dropped, in messages (SDC) too, as a controller does. A comment after a message begins with a
    blank and `;`, since a message may have a `;`.
    """
    lines = list(_lines(source))
    parsed = [_parsed(line) for line in lines]
    faults = [result for result in parsed if isinstance(result, ProgramFault)]
    faults += _without_room(lines, parsed)
    labels = _labels(parsed)
    faults += _duplicates(lines, parsed, labels)
    faults += _lost_jumps(lines, parsed, labels)
    if faults:
        return tuple(sorted(faults, key=lambda fault: (fault.line, fault.column)))
    instructions = tuple(result for result in parsed if not isinstance(result, ProgramFault))
    return Assembled(
        instructions,
        tuple(line.number for line in lines),
        MappingProxyType(labels),
        steps_of(instructions),
    )


def disassemble(instructions: Iterable[Instruction]) -> str:
    """Write instructions as a program text that assembles to the same."""
    return "".join(f"{_written(instruction)}\n" for instruction in instructions)


def steps_of(instructions: Iterable[Instruction]) -> int:
    """The room instructions take."""
    return sum(instruction.steps for instruction in instructions)


def _written(instruction: Instruction) -> str:
    if isinstance(instruction, Label | Communication):
        return instruction.text
    code, operands = instruction.code, instruction.text[len(instruction.code) :]
    if code == "SDC":
        return instruction.text if operands.startswith(";") else f"{code} {operands}"
    return f"{code} {operands.replace(',', ', ')}".rstrip()


def _lines(source: str) -> Iterator[_Line]:
    for number, line in enumerate(source.split("\n"), 1):
        comment = _COMMENT_AFTER_MESSAGE if _MESSAGE_LINE.match(line) else _COMMENT
        code = comment.sub("", line.removesuffix("\r"))
        columns = [column for column, character in enumerate(code, 1) if character not in _BLANKS]
        if columns:
            yield _Line(number, "".join(code[column - 1] for column in columns), tuple(columns))


def _parsed(line: _Line) -> Instruction | ProgramFault:
    try:
        return parse(line.text)
    except InstructionFault as fault:
        return line.fault(fault.at, fault.reason)


Parsed = Sequence[Instruction | ProgramFault]


def _labels(parsed: Parsed) -> dict[str, int]:
    """The address of each label; the first counts where there are several."""
    labels: dict[str, int] = {}
    for address, result in enumerate(parsed):
        if isinstance(result, Label):
            labels.setdefault(result.name, address)
    return labels


def _duplicates(lines: Sequence[_Line], parsed: Parsed, labels: Mapping[str, int]) -> Iterator[ProgramFault]:
    for address, (line, result) in enumerate(zip(lines, parsed, strict=True)):
        if isinstance(result, Label) and labels[result.name] != address:
            first = lines[labels[result.name]].number
            yield line.fault(0, f"The label {result.text} is there already, on line {first}.")


def _without_room(lines: Sequence[_Line], parsed: Parsed) -> Iterator[ProgramFault]:
    """The first instruction beyond the room for steps, addresses and labels."""
    steps = labels = 0
    for line, result in zip(lines, parsed, strict=True):
        if isinstance(result, ProgramFault):
            continue
        steps += result.steps
        labels += isinstance(result, Label)
        if steps > STEPS:
            yield line.fault(0, f"The program is too long from here: there is room for {STEPS} steps.")
            return
        if isinstance(result, Label) and labels == MOST_LABELS + 1:
            yield line.fault(0, f"The program has too many labels: {MOST_LABELS} are allowed.")


def _lost_jumps(lines: Sequence[_Line], parsed: Parsed, labels: Mapping[str, int]) -> Iterator[ProgramFault]:
    """Jumps to where nothing stands; a line with a fault counts as an instruction."""
    for address, (line, result) in enumerate(zip(lines, parsed, strict=True)):
        if isinstance(result, ProgramFault | Label | Communication):
            continue
        for operand in result.operands:
            reason = _lost(operand, address, len(parsed), labels)
            if reason:
                yield line.fault(_place_of_target(result.text), reason)


def _lost(operand: object, address: int, length: int, labels: Mapping[str, int]) -> str:
    """Why a jump leads nowhere; empty where it leads to an instruction."""
    if isinstance(operand, ToLabel):
        if operand.name not in labels:
            return f"There is no label *{operand.name}."
        return "" if labels[operand.name] + 1 < length else f"Nothing stands after the label *{operand.name}."
    if isinstance(operand, Offset) and not 0 <= address + operand.addresses < length:
        return f"The jump leads to address {address + operand.addresses}, where nothing stands."
    return ""


def _place_of_target(text: str) -> int:
    """Where the target of a jump begins: it is the last operand."""
    return text.rindex(",") + 1 if "," in text else len("JMP")
