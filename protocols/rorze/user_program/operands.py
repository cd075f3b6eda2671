"""Operands of instructions: memories, ports, numbers, places to jump to (RC-420 manual 15.2.5)."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal, cast

from protocols.rorze.notation import BILLION
from protocols.rorze.programs import LABEL, LARGEST_COUNT

Bank = Literal["D", "C", "T", "M", "ID", "OD", "SN"]
Index = Literal["IX", "IY"]
RegisterName = Literal["RX", "PP", "MT", "IX", "IY"]
Comparison = Literal["<", ">", "="]

BANKS: Final[Mapping[Bank, tuple[str, int]]] = MappingProxyType(
    {
        "D": ("data memory", 199),
        "C": ("counter", 29),
        "T": ("timer", 29),
        "M": ("memory flag", 199),
        "ID": ("input", 9),
        "OD": ("output", 15),
        "SN": ("sensor", 5),
    }
)
"""Every bank of memories with its last place, as the pages of chapter 16 have it."""

LAST_INDEX = 199
"""The largest value of an index memory."""

FARTHEST_JUMP = 199

LONGEST_MESSAGE = 16

_PLACE_IN_BANK = "IX|IY|0|[1-9][0-9]{0,2}"
DATA_MEMORY = rf"D(?:{_PLACE_IN_BANK})"
"""A data memory, wherever one may stand for a number."""


class OutOfRange(ValueError):
    """The operand has the right form, but does not exist."""


@dataclass(frozen=True, slots=True)
class BankPlace:
    """One place of a bank: fixed, or where an index memory points."""

    bank: Bank
    place: int | Index


@dataclass(frozen=True, slots=True)
class Register:
    """A memory that there is once: result buffer, position, motor flag, or an index memory."""

    name: RegisterName


@dataclass(frozen=True, slots=True)
class Constant:
    """A number written in the program."""

    value: int


@dataclass(frozen=True, slots=True)
class CompareSign:
    """The comparison of JCP."""

    comparison: Comparison


@dataclass(frozen=True, slots=True)
class ToLabel:
    """A jump to the address after a label."""

    name: str


@dataclass(frozen=True, slots=True)
class Offset:
    """A jump by a number of addresses, from that of the jump itself."""

    addresses: int


@dataclass(frozen=True, slots=True)
class Message:
    """The text that SDC sends."""

    text: str


@dataclass(frozen=True, slots=True)
class InHexadecimal:
    """A memory that SDD sends as 32 bits."""

    memory: BankPlace


Operand = BankPlace | Register | Constant | CompareSign | ToLabel | Offset | Message | InHexadecimal


@dataclass(frozen=True, slots=True)
class OperandKind:
    """The operands allowed at one place of an instruction."""

    words: str
    """Words for a sentence: `a timer (T0 to T29, TIX, TIY)`."""
    read: Callable[[str], Operand | None]
    """Give the operand, None where the text is something else.

    :raises OutOfRange: there is no such thing.
    """

    def __or__(self, other: "OperandKind") -> "OperandKind":
        """Either of two kinds, which never read the same text."""
        return OperandKind(f"{self.words}, {other.words}", lambda text: self.read(text) or other.read(text))


def memory_in(text: str) -> BankPlace | None:
    """Read a memory of any bank.

    :raises OutOfRange: the bank is not so large.
    """
    match = re.fullmatch(rf"(D|C|T|M|ID|OD|SN)({_PLACE_IN_BANK})", text)
    if match is None:
        return None
    bank, place = cast("Bank", match[1]), match[2]
    if place in ("IX", "IY"):
        return BankPlace(bank, cast("Index", place))
    if int(place) > BANKS[bank][1]:
        raise OutOfRange(f"{text} does not exist; the last {BANKS[bank][0]} is {bank}{BANKS[bank][1]}")
    return BankPlace(bank, int(place))


def _bank(bank: Bank) -> OperandKind:
    def read(text: str) -> BankPlace | None:
        found = memory_in(text)
        return found if found and found.bank == bank else None

    name, last = BANKS[bank]
    return OperandKind(f"{name} {bank}0-{bank}{last}", read)


def _register(name: RegisterName, words: str) -> OperandKind:
    return OperandKind(f"{words} {name}", lambda text: Register(name) if text == name else None)


def _number(first: int, last: int, *, hexadecimal: int | None = None) -> OperandKind:
    """A decimal number in a range; in hexadecimal from 0 to its own last one, where that is given."""

    def read(text: str) -> Constant | None:
        bits = re.fullmatch("H([0-9A-F]{1,8})", text)
        if bits is None and re.fullmatch("[+-]?[0-9]{1,12}", text) is None:
            return None
        if bits is not None and hexadecimal is None:
            return None
        value = int(bits[1], 16) if bits else int(text)
        lowest, highest = (0, hexadecimal or 0) if bits else (first, last)
        if not lowest <= value <= highest:
            raise OutOfRange(f"{text} is out of range: {words}")
        return Constant(value)

    words = f"number {first} to {last}"
    if hexadecimal is not None:
        words += f" or H0 to H{hexadecimal:X}"
    return OperandKind(words, read)


def _one_of(*values: int) -> OperandKind:
    def read(text: str) -> Constant | None:
        return Constant(int(text)) if text in map(str, values) else None

    return OperandKind(f"number {', '.join(map(str, values))}", read)


def _read_label(text: str) -> ToLabel | None:
    return ToLabel(text[1:]) if re.fullmatch(rf"\*{LABEL}", text) else None


def _read_offset(text: str) -> Offset | None:
    if re.fullmatch("[+-][0-9]{1,12}", text) is None:
        return None
    if abs(int(text)) > FARTHEST_JUMP or text.startswith("-0"):
        raise OutOfRange(f"{text} is out of range: +0 to +{FARTHEST_JUMP}, -1 to -{FARTHEST_JUMP}")
    return Offset(int(text))


def _read_message(text: str) -> Message | None:
    if len(text) > LONGEST_MESSAGE:
        raise OutOfRange(f"the message has {len(text)} characters, {LONGEST_MESSAGE} are allowed")
    return Message(text) if text else None


def _read_bits(text: str) -> InHexadecimal | None:
    memory = memory_in(text[1:]) if text.startswith("H") else None
    return InHexadecimal(memory) if memory and memory.bank in ("D", "T", "C") else None


DATA, COUNTER, TIMER, FLAG, INPUT, OUTPUT, SENSOR = map(_bank, BANKS)
RESULT = _register("RX", "result buffer")
POSITION = _register("PP", "position")
MOTOR = _register("MT", "motor flag")
INDEX = _register("IX", "index memory") | _register("IY", "index memory")
NUMBER = _number(1 - BILLION, BILLION - 1, hexadecimal=0xFFFFFFFF)
MASK = _number(0, BILLION - 1, hexadecimal=0xFFFFFFFF)
COUNT = _number(0, LARGEST_COUNT)
INDEX_NUMBER = _number(0, LAST_INDEX)
BIT = _number(0, 31, hexadecimal=31)
LEVEL = _one_of(0, 1)
ERROR_BIT = _one_of(1, 2, 6, 7)
SIGN = OperandKind(
    "sign <, >, =", lambda text: CompareSign(cast("Comparison", text)) if text in ("<", ">", "=") else None
)
LABELLED = OperandKind("label (*NAME)", _read_label)
PLACE = LABELLED | OperandKind(f"distance +0 to +{FARTHEST_JUMP} or -1 to -{FARTHEST_JUMP}", _read_offset)
MESSAGE = OperandKind(f"message of 1 to {LONGEST_MESSAGE} characters", _read_message)
BITS = OperandKind("H and a data memory, counter or timer", _read_bits)
SWITCH = FLAG | INPUT | OUTPUT | SENSOR | TIMER | COUNTER | MOTOR
"""Operands that are on or off: a timer while it counts, a counter above 0, the motor flag while it moves."""
