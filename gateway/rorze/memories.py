"""Data memories, counters and timers of user programs (RC-420 manual 14.U, 15.2.5)."""

import re
from collections.abc import Sequence
from typing import Annotated, Any, Final

from pydantic import Field

from gateway.core.errors import GatewayError, InvalidRequest
from gateway.core.operation import Rows
from gateway.core.records import AnswerModel, RequestModel, SentBack, example
from gateway.core.rights import Right
from gateway.rorze.asked_body import AskedBody
from gateway.rorze.errors import PartlyDone
from protocols.rorze.notation import BILLION
from protocols.rorze.programs import LARGEST_COUNT, GetProgramMemory, SetProgramMemory

ROWS: Final = Rows("programs")
MOST: Final = 200
"""Size of the largest bank."""
MemoryName = Annotated[str, Field(description="D0-D199, C0-C29 or T0-T29.", examples=["D0"])]
First = Annotated[str, Field(description="D0-D199, C0-C29 or T0-T29.", max_length=8)]
Count = Annotated[int, Field(ge=1, le=MOST, description="Number of memories of the same bank.")]
LAST_PLACES = {"D": 199, "C": 29, "T": 29}

_NAME = re.compile("([DCT])(0|[1-9][0-9]{0,2})")


class Memory(AnswerModel):
    """A memory of the user program."""

    name: str
    value: int | None = Field(description="A timer counts tenths of a second down.")


class MemoryList(AnswerModel):
    """Memories of one bank."""

    body_id: str
    memories: list[Memory]


Value = Annotated[
    int,
    Field(description="A data memory holds -999999999 to 999999999, a counter or timer 0 to 9999999."),
]


AS_IT_IS: Final[Any] = Field(
    description="A value that is null, as GET gives it, leaves a memory without a number as it is."
)


class MemoryChange(SentBack, json_schema_extra=example(value=12)):
    """A number for a memory."""

    read_only = frozenset(("name",))

    value: Value | None = AS_IT_IS


class NamedMemory(RequestModel):
    """A memory, and what it shall hold."""

    name: Annotated[str, Field(description="D0-D199, C0-C29 or T0-T29.", max_length=8)]
    value: Value | None = AS_IT_IS


class MemoryChanges(SentBack, json_schema_extra=example(memories=[{"name": "D0", "value": 12}])):
    """Numbers for memories."""

    read_only = frozenset(("body_id",))

    memories: Annotated[list[NamedMemory], Field(min_length=1, max_length=MOST)]


def signed(bits: int) -> int:
    """The number that 32 bits are, with its sign; two's complement, an assumption."""
    return bits - (1 << 32) if bits >= 1 << 31 else bits


def limits(name: str) -> tuple[int, int]:
    """The least and the largest number that a memory holds; a timer counts tenths of a second down."""
    return (1 - BILLION, BILLION - 1) if name[0] == "D" else (0, LARGEST_COUNT)


async def read(body: AskedBody, first: str, count: int) -> list[Memory]:
    """Read memories of one bank, one by one (UDD).

    :raises InvalidRequest: the bank does not have all of them.
    :raises GatewayError: they were not read.
    """
    bank, place = _split(first)
    if place + count - 1 > LAST_PLACES[bank]:
        raise InvalidRequest(f"count: the last of {bank} is {bank}{LAST_PLACES[bank]}; nothing was sent.")
    return [await _read(body, f"{bank}{place + offset}") for offset in range(count)]


async def write(body: AskedBody, wanted: Sequence[tuple[str, int]]) -> list[Memory]:
    """Set memories in order (UDS), and give what they hold then: a program that runs may change them at once.

    :raises InvalidRequest: there is no such memory, or it cannot hold the number; nothing was sent.
    :raises PartlyDone: it was broken off after the first.
    :raises GatewayError: none was set, or read back.
    """
    commands = [_setting(name, value) for name, value in wanted]
    names = [command.memory for command in commands]
    for name in names:
        if names.count(name) > 1:
            raise InvalidRequest(f"Memory {name} is given twice; nothing was sent.")
    held: list[Memory] = []
    for place, command in enumerate(commands):
        try:
            await body.ask(command)
            held.append(await _read(body, command.memory))
        except GatewayError as error:
            if not held:
                raise
            done, left = (
                [command.code + command.written() for command in part]
                for part in (commands[:place], commands[place:])
            )
            raise PartlyDone(body.address, done, left, error) from error
    return held


def _setting(name: str, value: int) -> SetProgramMemory:
    bank, place = _split(name)
    least, largest = limits(bank)
    if not least <= value <= largest:
        raise InvalidRequest(f"value: {bank}{place} holds {least} to {largest}; nothing was sent.")
    return SetProgramMemory(memory=f"{bank}{place}", value=value)


async def _read(body: AskedBody, name: str) -> Memory:
    """Read a memory; None where its 32 bits are no number that the controller can tell (UDD)."""
    held, _ = await body.ask(GetProgramMemory(memory=name))
    if name[0] == "D" and held.value is not None and abs(held.value) == BILLION - 1:
        whole, _ = await body.ask(GetProgramMemory(memory=name, notation="hexadecimal"))
        if whole.bits is None or signed(whole.bits) != held.value:
            return Memory(name=name, value=None)
    return Memory(name=name, value=held.value)


async def _change(body: AskedBody, wanted: Sequence[NamedMemory]) -> list[Memory]:
    """Set memories, but those that are named as null; errors as of `write`."""
    left = [await _no_number(body, memory.name) for memory in wanted if memory.value is None]
    held = await write(body, [(memory.name, memory.value) for memory in wanted if memory.value is not None])
    told = {memory.name: memory for memory in (*left, *held)}
    return [told[memory.name.upper()] for memory in wanted]


async def _no_number(body: AskedBody, name: str) -> Memory:
    """Read a memory that shall stay as it is.

    :raises InvalidRequest: it holds a number, which null is not; nothing was sent.
    """
    bank, place = _split(name)
    held = await _read(body, f"{bank}{place}")
    if held.value is not None:
        raise InvalidRequest(f"value: null is no value of {held.name}, which holds one; nothing was sent.")
    return held


def _split(name: str) -> tuple[str, int]:
    match = _NAME.fullmatch(name.upper())
    if match is None or int(match[2]) > LAST_PLACES[match[1]]:
        raise InvalidRequest(
            f"There is no memory {name!r}: they are D0-D199, C0-C29 and T0-T29; nothing was sent."
        )
    return match[1], int(match[2])


@ROWS.get("/bodies/{body_id}/memories")
async def get_memories(body: AskedBody, *, first: First = "D0", count: Count = 1) -> MemoryList:
    """Read memories of the user program, one by one (UDD)."""
    return MemoryList(body_id=body.address, memories=await read(body, first, count))


@ROWS.put("/bodies/{body_id}/memories", Right.OPERATE)
async def set_memories(body: AskedBody, change: MemoryChanges) -> MemoryList:
    """Set memories in order (UDS), and tell what they hold then: a program may change them at once."""
    change.require_unchanged(MemoryList(body_id=body.address, memories=[]))
    held = await _change(body, change.memories)
    return MemoryList(body_id=body.address, memories=held)


@ROWS.put("/bodies/{body_id}/memories/{name}", Right.OPERATE)
async def set_memory(body: AskedBody, name: MemoryName, change: MemoryChange) -> Memory:
    """Set a memory (UDS), and tell what it holds then: a program that runs may change it at once."""
    change.require_unchanged(Memory(name=name.upper(), value=None))
    [held] = await _change(body, [NamedMemory(name=name, value=change.value)])
    return held
