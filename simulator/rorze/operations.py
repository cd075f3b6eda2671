"""The thirty commands of the user program, each as an operation (RC-420 manual 16)."""

from collections.abc import Callable
from dataclasses import dataclass

from protocols.rorze.programs import LARGEST_COUNT
from protocols.rorze.user_program.instruction import ProgramOperation
from protocols.rorze.user_program.operands import (
    LAST_INDEX,
    BankPlace,
    CompareSign,
    Constant,
    InHexadecimal,
    Message,
    Offset,
    Operand,
    ToLabel,
)
from simulator.rorze.actions import OUT_OF_RANGE, Refused
from simulator.rorze.axis import held
from simulator.rorze.program_memory import TICK_S
from simulator.rorze.settings import FARTHEST
from simulator.rorze.variables import Variables, as_bits, as_number

NORMAL, RUNNING, BY_UES, COMMAND_ERROR, NO_INSTRUCTION, BY_EED, MOVE_WHILE_MOVING, STEPPED = (
    0x00,
    0x01,
    0x02,
    0x04,
    0x08,
    0x10,
    0x20,
    0x80,
)
"""Status bits of a program, as URD tells them (RC-420 manual 15.2.6)."""

ERROR_BITS = 0b1100_0110
"""The errors in the controller status that JER and EED heed: limit, EMS, STALL, communication."""


class Ended(Exception):
    """The program ends; `cause` is what URD is to tell."""

    def __init__(self, cause: int) -> None:
        super().__init__(f"end cause {cause:02X}")
        self.cause = cause


@dataclass(frozen=True, slots=True)
class Wait:
    """Go on with the next address after some time."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Call:
    """Go on after a label, and later after this address."""

    label: ToLabel


@dataclass(frozen=True, slots=True)
class Return:
    """Go on after the last call."""


Target = ToLabel | Offset
Turn = Target | Wait | Call | Return | None
"""The place where a program goes on; None is the next address."""

_TABLE: dict[str, Callable[..., Turn]] = {}


def operate(operation: ProgramOperation, variables: Variables) -> Turn:
    """Do an operation.

    :raises Refused: it is a command error.
    :raises Ended: it ends the program.
    """
    return _TABLE[operation.code](variables, *operation.operands)


A = Callable[..., Turn]


def _does(*codes: str) -> Callable[[A], A]:
    """Enter the decorated function into the table as what these operations do."""

    def enter(function: A) -> A:
        _TABLE.update(dict.fromkeys(codes, function))
        return function

    return enter


# Data


@_does("LD")
def _load(on: Variables, target: BankPlace, source: BankPlace, last: Constant | None = None) -> None:
    if last is None:
        on.store(target, on.value(source))
    elif target.bank == "D":
        mask = (2 << last.value) - 1
        kept = as_bits(on.value(target)) & ~mask
        on.store(target, kept | on.copy_from(source, last.value))
    else:
        on.copy_to(target, last.value, as_bits(on.value(source)))


@_does("TMS", "CTS")
def _set_count(on: Variables, target: BankPlace, source: Operand) -> None:
    on.store(target, on.value(source))


@_does("SET")
def _set(on: Variables, target: BankPlace) -> None:
    on.turn(target, True)


@_does("RST")
def _reset(on: Variables, target: BankPlace) -> None:
    on.turn(target, False)


@_does("BST")
def _set_bit(on: Variables, target: BankPlace, bit: Constant, level: Constant) -> None:
    bits = as_bits(on.value(target)) & ~(1 << bit.value)
    on.store(target, bits | level.value << bit.value)


# Arithmetic


def _largest(target: Operand) -> int:
    if isinstance(target, BankPlace):
        return FARTHEST if target.bank == "D" else LARGEST_COUNT
    return LAST_INDEX


def _smallest(target: Operand) -> int:
    return -FARTHEST if isinstance(target, BankPlace) and target.bank == "D" else 0


@_does("INC")
def _increment(on: Variables, target: Operand) -> None:
    value = on.value(target)
    if value < _largest(target):
        on.store(target, value + 1)


@_does("DEC")
def _decrement(on: Variables, target: Operand) -> None:
    value = on.value(target)
    if value > _smallest(target):
        on.store(target, value - 1)


@_does("ADD")
def _add(on: Variables, target: Operand, source: Operand) -> None:
    on.store(target, on.value(target) + on.value(source))


@_does("SUB")
def _subtract(on: Variables, target: Operand, source: Operand) -> None:
    on.store(target, on.value(target) - on.value(source))


@_does("MUL")
def _multiply(on: Variables, target: Operand, source: Operand) -> None:
    on.store(target, on.value(target) * on.value(source))


@_does("DIV")
def _divide(on: Variables, target: Operand, source: Operand) -> None:
    """Towards zero."""
    dividend, divisor = on.value(target), on.value(source)
    if divisor == 0:
        raise Refused(OUT_OF_RANGE)
    quotient = abs(dividend) // abs(divisor)
    on.store(target, quotient if (dividend < 0) == (divisor < 0) else -quotient)


# Logic


@_does("AND")
def _and(on: Variables, target: BankPlace, source: Operand) -> None:
    if target.bank == "M":
        on.turn(target, on.is_on(target) and on.is_on(source))
    else:
        on.store(target, on.value(target) & on.value(source))


@_does("OR")
def _or(on: Variables, target: BankPlace, source: Operand) -> None:
    if target.bank == "M":
        on.turn(target, on.is_on(target) or on.is_on(source))
    else:
        on.store(target, on.value(target) | on.value(source))


@_does("RSL")
def _rotate_left(on: Variables, target: BankPlace) -> None:
    bits = as_bits(on.value(target))
    on.store(target, bits << 1 | bits >> 31)


@_does("RSR")
def _rotate_right(on: Variables, target: BankPlace) -> None:
    bits = as_bits(on.value(target))
    on.store(target, bits >> 1 | (bits & 1) << 31)


# Jumps


@_does("JMP")
def _jump(_: Variables, place: Target) -> Turn:
    return place


@_does("CAL")
def _call(_: Variables, label: ToLabel) -> Turn:
    return Call(label)


@_does("RET")
def _return(_: Variables) -> Turn:
    return Return()


@_does("JCP")
def _jump_comparing(on: Variables, left: Operand, sign: CompareSign, right: Operand, place: Target) -> Turn:
    """Bits written in hexadecimal are those of a number with a sign, as in a data memory."""
    first, second = on.value(left), as_number(on.value(right))
    holds = {"<": first < second, ">": first > second, "=": first == second}[sign.comparison]
    holds |= on.machine.compares_inclusively and first == second
    return place if holds else None


@_does("JMG")
def _jump_with_message(on: Variables, place: Target) -> Turn:
    return place if on.machine.text_waits() else None


@_does("JON")
def _jump_on(on: Variables, switch: Operand, place: Target) -> Turn:
    return place if on.is_on(switch) else None


@_does("JOF")
def _jump_off(on: Variables, switch: Operand, place: Target) -> Turn:
    return None if on.is_on(switch) else place


@_does("JBT")
def _jump_on_bit(on: Variables, memory: BankPlace, bit: Constant, level: Constant, place: Target) -> Turn:
    return place if as_bits(on.value(memory)) >> bit.value & 1 == level.value else None


@_does("JER")
def _jump_on_error(on: Variables, *operands: Operand) -> Turn:
    match operands:
        case (Constant(bit), ToLabel() | Offset() as place):
            return place if on.machine.status >> bit & 1 else None
        case (ToLabel() | Offset() as place,):
            return place if on.machine.status & ERROR_BITS else None
    raise TypeError(f"JER cannot have {operands}")


# Ends, waits, messages


@_does("EED")
def _end_on_error(on: Variables) -> None:
    if on.machine.status & ERROR_BITS:
        raise Ended(BY_EED)


@_does("END")
def _end(_: Variables) -> None:
    raise Ended(NORMAL)


@_does("WAT")
def _wait(_: Variables, ticks: Constant) -> Turn:
    return Wait(ticks.value * TICK_S)


@_does("SDC")
def _send_message(on: Variables, message: Message) -> None:
    on.machine.send_text(message.text, on.now)


@_does("SDD")
def _send_data(on: Variables, source: BankPlace | InHexadecimal) -> None:
    """As UDD answers."""
    if isinstance(source, InHexadecimal):
        text = f"H{as_bits(on.value(source.memory)):08X}"
    else:
        text = f"{held(on.value(source)):+010d}"
    on.machine.send_text(text, on.now)
