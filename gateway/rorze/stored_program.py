"""The user program that a body holds, read instruction by instruction (RC-420 manual 14.U, 15.2.6)."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from gateway.core.errors import BodyBusy, ControllerRefused, GatewayError, InvalidText, Misplaced
from gateway.core.exchange import Lane
from gateway.rorze.asked_body import closely
from gateway.rorze.bodies import Body
from protocols.rorze.moves import RelativeMove
from protocols.rorze.programs import (
    LAST_ADDRESS,
    STEPS,
    GetFreeProgramSteps,
    GetLastProgramAddress,
    GetProgramLine,
    GetProgramStatus,
)
from protocols.rorze.user_program.assembler import disassemble
from protocols.rorze.user_program.instruction import Communication, Instruction, InstructionFault, parse
from protocols.table import WireFault

NOTHING_THERE = "0x5B"
"""The refusal of a question for what stands in an empty program."""
RUNS = 0x01
"""Bit of a program's status (URD)."""


class StoredProgram(NamedTuple):
    """A program in a body's RAM."""

    instructions: tuple[str, ...]
    """Instructions by address."""
    steps: int
    """The room it takes, as the controller counts it (UBD)."""
    running: bool

    @property
    def source(self) -> str:
        """Its text, an instruction a line: line N is address N - 1."""
        return "".join(f"{as_written(text)}\n" for text in self.instructions)

    @property
    def labels(self) -> dict[str, int]:
        """The address of each label."""
        return {text[1:]: address for address, text in enumerate(self.instructions) if text[0] == "*"}


async def read(body: Body) -> StoredProgram:
    """Read the whole program.

    :raises GatewayError: it was not read.
    """
    instructions = await read_instructions(body)
    free, _ = await body.ask(GetFreeProgramSteps())
    return StoredProgram(tuple(instructions), STEPS - free.steps, await runs(body))


async def read_instructions(body: Body, on_read: Callable[[], None] = lambda: None) -> list[str]:
    """Read all instructions, and tell of each.

    Each is asked for by its address, which the answer repeats: so none can be mistaken for another.
    """
    found: list[str] = []
    written = await addresses(body)
    async for text in closely(instruction_at(body, address) for address in written):
        if text is not None:
            found.append(text)
        on_read()
    return found


async def addresses(body: Body) -> range:
    """Ask at which addresses something stands (UED): a question for another one is a command error.

    A full program ends at the last address, where one with an instruction less ends too.
    """
    end, _ = await body.ask(GetLastProgramAddress())
    return range(end.address + (end.address == LAST_ADDRESS))


async def instruction_at(body: Body, address: int, lane: Lane | None = None) -> str | None:
    """Read what stands at an address; None where nothing does."""
    try:
        line, _ = await body.ask(GetProgramLine(address=address), lane=lane)
    except ControllerRefused as refusal:
        if refusal.error_code != NOTHING_THERE:
            raise
        return None
    return line.instruction


async def runs(body: Body) -> bool:
    """Ask whether a program runs (URD)."""
    status, _ = await body.ask(GetProgramStatus())
    return bool(status.status & RUNS)


def as_written(text: str) -> str:
    """An instruction as people write it; as the controller tells it where it is not known."""
    try:
        return disassemble([parse(text)]).rstrip("\n")
    except InstructionFault:
        return text


MOST_TOLD = 100
"""Lines that are named at once."""
REMEDY = "Give a distance, or set allow_endless_moves in the configuration."


class EndlessPrograms:
    """Refuses programs with a move that only a stop ends (`1+MZ`), at the upload and at the start."""

    def __init__(self, *, allowed: bool) -> None:
        self._allowed = allowed

    def forbid(
        self, instructions: Sequence[Instruction], lines: Sequence[int], what: str, text: str = "source"
    ) -> None:
        """Refuse a program that has one; `lines` are those in its `text`, and `what` was not done.

        :raises InvalidText: it has, with each line.
        """
        if self._allowed:
            return
        endless = [line for text, line in zip(instructions, lines, strict=True) if has_no_end(text)]
        if endless:
            reason = "The move has no end, and the configuration does not allow that."
            raise InvalidText(
                text,
                f"Line {endless[0]}: {reason} {what}.",
                REMEDY,
                [Misplaced(line, 1, reason) for line in endless[:MOST_TOLD]],
            )

    async def learn(self, body: Body) -> None:
        """Know that the program in a body has none before it is run; read where it may be another.

        :raises InvalidText: it has, with each line; line N stands at address N - 1.
        :raises GatewayError: it could not be read.
        """
        if self._allowed or body.told.program_ends:
            return
        program = [_parsed(text) for text in await read_instructions(body)]
        self.forbid(program, range(1, len(program) + 1), f"The program of {body.address} was not started")
        body.told.program_was_read()

    def refuses_start(self, body: Body, code: str) -> GatewayError | None:
        """Why a program must not be started in this instant: it may be another than was looked at."""
        if self._allowed or body.told.program_ends:
            return None
        return BodyBusy(
            f"{body.address} may have another program than was searched for moves without an end, "
            f"or its power or line was away; {code} was not sent.",
            "Start it again: its program is read anew.",
        )


def has_no_end(instruction: Instruction) -> bool:
    """Tell whether an instruction is a move that only a stop ends."""
    if not isinstance(instruction, Communication) or not issubclass(instruction.row, RelativeMove):
        return False
    try:
        command = instruction.command(lambda _: 1)
    except WireFault:
        return False
    return isinstance(command, RelativeMove) and command.distance == "endless"


def _parsed(text: str) -> Instruction:
    """Parse what a controller tells; what is no known instruction counts as a label, which moves nothing."""
    try:
        return parse(text)
    except InstructionFault:
        return parse("*X")
