"""The memories and ports of a controller, as user programs name them (RC-420 manual 15.2.5)."""

from typing import Protocol

from protocols.rorze.programs import LARGEST_COUNT
from protocols.rorze.user_program.operands import (
    BANKS,
    LAST_INDEX,
    Bank,
    BankPlace,
    Constant,
    Operand,
    Register,
)
from simulator.rorze.actions import OUT_OF_RANGE, Order, Outcome, Refused
from simulator.rorze.io import Ports
from simulator.rorze.motor import Motor
from simulator.rorze.program_memory import Memories
from simulator.rorze.world import CCW_LIMIT, CW_LIMIT, EMS, IN_POSITION, ORIGIN, STALL
from simulator.truth import TruthLog

SENSORS = (STALL, ORIGIN, CW_LIMIT, CCW_LIMIT, EMS, IN_POSITION)
"""The sensors as SN0 to SN5 count them, which is not the order of CLD."""

BITS = 1 << 32
"""The bounds of a data memory."""


class Machine(Protocol):
    """A controller, as its user program knows it."""

    body: int
    truth: TruthLog
    memories: Memories
    motor: Motor
    io: Ports
    status: int
    compares_inclusively: bool

    def position(self, now: float) -> int:
        """The position in the unit of the operating mode."""

    def perform(self, order: Order, now: float) -> Outcome:
        """Do a command.

        :raises Refused: it has had no effect.
        """

    def send_text(self, text: str, now: float) -> None:
        """Put a text where the link master collects it; one that still waits there is lost."""

    def text_waits(self) -> bool:
        """Tell whether a text has not been collected."""


def as_bits(value: int) -> int:
    """The 32 bits of a data memory."""
    return value % BITS


def as_number(bits: int) -> int:
    """The part of a number that a data memory holds: its lowest 32 bits, signed; an assumption."""
    return (bits + BITS // 2) % BITS - BITS // 2


class Variables:
    """Reads and writes operands; times are seconds on one clock."""

    def __init__(self, machine: Machine, now: float) -> None:
        self.machine = machine
        self.now = now
        """The moment of the instruction that is executed."""

    def value(self, operand: Operand) -> int:
        """The number an operand stands for."""
        match operand:
            case Constant(value):
                return value
            case Register("PP"):
                return self.machine.position(self.now)
            case Register(name):
                return self.machine.memories.get(name, self.now)
            case BankPlace("D" | "C" | "T" as bank):
                return self.machine.memories.get(f"{bank}{self._place(operand)}", self.now)
        raise TypeError(f"{operand} has no value")

    def store(self, operand: Operand, value: int) -> None:
        """Write a number to a data memory, a counter, a timer or an index memory.

        A data memory keeps what it can of a number that is too large.

        :raises Refused: the number is too large for the others, or negative.
        """
        match operand:
            case BankPlace("D"):
                self._set(f"D{self._place(operand)}", as_number(value))
            case BankPlace(bank):
                _require(0 <= value <= LARGEST_COUNT)
                self._set(f"{bank}{self._place(operand)}", value)
            case Register(name):
                _require(0 <= value <= LAST_INDEX)
                self._set(name, value)

    def keep_result(self, value: int) -> None:
        """Put what a command has answered into the result buffer."""
        self._set("RX", value)

    def is_on(self, operand: Operand) -> bool:
        """Tell whether a flag, port, sensor or motor is on; a timer while it counts, a counter above 0."""
        match operand:
            case Register():
                return self.machine.motor.moving
            case BankPlace("C" | "T"):
                return self.value(operand) != 0
            case BankPlace(bank):
                return self._level(bank, self._place(operand))
        raise TypeError(f"{operand} is neither on nor off")

    def turn(self, operand: BankPlace, on: bool) -> None:
        """Turn a flag or an output on or off."""
        self._turn(operand.bank, self._place(operand), on)

    def copy_from(self, operand: BankPlace, last: int) -> int:
        """The bits of a memory and the `last` ones after it; those that do not exist are 0, an assumption."""
        bank, first = operand.bank, self._place(operand)
        places = range(first, min(first + last, BANKS[bank][1]) + 1)
        return sum(self._level(bank, place) << place - first for place in places)

    def copy_to(self, operand: BankPlace, last: int, bits: int) -> None:
        """Write bits to a memory and the `last` ones after it that exist."""
        bank, first = operand.bank, self._place(operand)
        for place in range(first, min(first + last, BANKS[bank][1]) + 1):
            self._turn(bank, place, bool(bits >> place - first & 1))

    def _place(self, memory: BankPlace) -> int:
        """The place of a memory in its bank.

        :raises Refused: an index memory points beyond the bank, an assumption.
        """
        if isinstance(memory.place, int):
            return memory.place
        place = self.machine.memories.get(memory.place, self.now)
        _require(place <= BANKS[memory.bank][1])
        return place

    def _level(self, bank: Bank, place: int) -> bool:
        io = self.machine.io
        match bank:
            case "ID":
                return bool(io.inputs() >> place & 1)
            case "OD":
                return io.outputs.level(place)
            case "SN":
                return io.sensor(SENSORS[place])
        return bool(self.machine.memories.get(f"{bank}{place}", self.now))

    def _turn(self, bank: Bank, place: int, on: bool) -> None:
        if bank == "OD":
            self.machine.io.outputs.set(place, on)
        else:
            self._set(f"{bank}{place}", int(on))

    def _set(self, name: str, value: int) -> None:
        self.machine.memories.set(name, value, self.now)


def _require(allowed: bool) -> None:
    if not allowed:
        raise Refused(OUT_OF_RANGE)
