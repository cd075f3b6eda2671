"""Data memories, counters and timers of user programs (RC-420 manual 14.U, 15.2.5)."""

import re
from collections.abc import Sequence
from typing import NamedTuple

from gateway.core.errors import GatewayError, InvalidRequest
from gateway.rorze.bodies import Body
from gateway.rorze.errors import PartlyDone
from protocols.rorze.notation import BILLION
from protocols.rorze.programs import LARGEST_COUNT, GetProgramMemory, SetProgramMemory

LAST_PLACES = {"D": 199, "C": 29, "T": 29}

_NAME = re.compile("([DCT])(0|[1-9][0-9]{0,2})")


class MemoryValue(NamedTuple):
    """A memory and the number it holds."""

    name: str
    value: int | None


def signed(bits: int) -> int:
    """The number that 32 bits are, with its sign; two's complement, an assumption."""
    return bits - (1 << 32) if bits >= 1 << 31 else bits


def limits(name: str) -> tuple[int, int]:
    """The least and the largest number that a memory holds; a timer counts tenths of a second down."""
    return (1 - BILLION, BILLION - 1) if name[0] == "D" else (0, LARGEST_COUNT)


async def read(body: Body, first: str, count: int) -> list[MemoryValue]:
    """Read memories of one bank, one by one (UDD).

    :raises InvalidRequest: the bank does not have all of them.
    :raises GatewayError: they were not read.
    """
    bank, place = _split(first)
    if place + count - 1 > LAST_PLACES[bank]:
        raise InvalidRequest(f"count: the last of {bank} is {bank}{LAST_PLACES[bank]}; nothing was sent.")
    return [await _read(body, f"{bank}{place + offset}") for offset in range(count)]


async def write(body: Body, wanted: Sequence[tuple[str, int]]) -> list[MemoryValue]:
    """Set memories in order (UDS), and give what they hold then: a program that runs may change them at once.

    :raises InvalidRequest: there is no such memory, or it cannot hold the number; nothing was sent.
    :raises PartlyDone: it was broken off after the first.
    :raises GatewayError: none was set, or read back.
    """
    commands = [_setting(name, value) for name, value in wanted]
    names = [it.memory for it in commands]
    for name in names:
        if names.count(name) > 1:
            raise InvalidRequest(f"Memory {name} is given twice; nothing was sent.")
    held: list[MemoryValue] = []
    for place, command in enumerate(commands):
        try:
            await body.ask(command)
            held.append(await _read(body, command.memory))
        except GatewayError as error:
            if not held:
                raise
            done, left = (
                [it.code + it.written() for it in part] for part in (commands[:place], commands[place:])
            )
            raise PartlyDone(body.address, done, left, error) from error
    return held


def _setting(name: str, value: int) -> SetProgramMemory:
    bank, place = _split(name)
    least, largest = limits(bank)
    if not least <= value <= largest:
        raise InvalidRequest(f"value: {bank}{place} holds {least} to {largest}; nothing was sent.")
    return SetProgramMemory(memory=f"{bank}{place}", value=value)


async def _read(body: Body, name: str) -> MemoryValue:
    """Read a memory; None where its 32 bits are no number that the controller can tell (UDD)."""
    held, _ = await body.ask(GetProgramMemory(memory=name))
    if name[0] == "D" and held.value is not None and abs(held.value) == BILLION - 1:
        whole, _ = await body.ask(GetProgramMemory(memory=name, notation="hexadecimal"))
        if whole.bits is None or signed(whole.bits) != held.value:
            return MemoryValue(name, None)
    return MemoryValue(name, held.value)


def _split(name: str) -> tuple[str, int]:
    match = _NAME.fullmatch(name.upper())
    if match is None or int(match[2]) > LAST_PLACES[match[1]]:
        raise InvalidRequest(
            f"There is no memory {name!r}: they are D0-D199, C0-C29 and T0-T29; nothing was sent."
        )
    return match[1], int(match[2])
