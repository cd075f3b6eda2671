"""The user program that a body holds, read instruction by instruction (RC-420 manual 14.U, 15.2.6)."""

from collections.abc import Callable
from typing import NamedTuple

from gateway.core.errors import ControllerRefused
from gateway.core.lanes import Lane
from gateway.rorze.bodies import Body
from gateway.rorze.readings import closely
from protocols.rorze.programs import (
    LAST_ADDRESS,
    STEPS,
    GetFreeProgramSteps,
    GetLastProgramAddress,
    GetProgramLine,
    GetProgramStatus,
)
from protocols.rorze.user_program.assembler import disassemble
from protocols.rorze.user_program.instruction import InstructionFault, parse

NOTHING_THERE = "0x5B"
"""The refusal of a question for what stands in an empty program."""
RUNS = 0x01
"""Bit of a program's status (URD)."""


class StoredProgram(NamedTuple):
    """A program in a body's RAM."""

    instructions: tuple[str, ...]
    """By address."""
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
