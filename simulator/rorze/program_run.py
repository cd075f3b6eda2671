"""A user program while it runs: one instruction after the other, in given time (RC-420 manual 15.2.6)."""

from math import ceil

from protocols.rorze.user_program.instruction import (
    Communication,
    Instruction,
    Label,
    ProgramOperation,
    parse,
)
from protocols.rorze.user_program.operands import BankPlace, Operand, Register, ToLabel
from protocols.table import Reply, WireFault
from simulator.rorze.actions import Refused, order_of
from simulator.rorze.operations import (
    BY_UES,
    COMMAND_ERROR,
    MOVE_WHILE_MOVING,
    NO_INSTRUCTION,
    NORMAL,
    RUNNING,
    STEPPED,
    Call,
    Ended,
    Return,
    Target,
    Turn,
    Wait,
    operate,
)
from simulator.rorze.variables import Machine, Variables

INSTRUCTION_S = 0.001
"""Seconds from one instruction's effect to the next: an assumption, the manual does not say."""

DEEPEST_CALL = 16

# Of an instruction: far above the rounding of any clock, far below what matters.
_ROUNDING = 1e-6


class ProgramRun:
    """The address, the calls and the end cause; nothing happens but in a call, and `now` never goes back.

    Jumps that only something outside can end, such as `JON MT, +0`, are not gone through: the program sleeps,
    and when something may have changed it goes on at the address it would be at.
    """

    def __init__(self, machine: Machine, now: float) -> None:
        self.address = 0
        """The one that is executed next, or where the program has ended."""
        self.cause = NORMAL
        self.next_at: float | None = None
        """Time at which the next instruction is due; None while the program has ended or sleeps."""
        self._machine = machine
        self._variables = Variables(machine, now)
        self._program: tuple[str, ...] = ()
        self._instructions: tuple[Instruction, ...] = ()
        self._labels: dict[str, int] = {}
        self._calls: list[int] = []
        self._single = self._waiting = self._ending = False
        self._trail: dict[int, None] = {}
        """The jumps gone through since anything has changed, in order."""
        self._circle: list[int] = []
        self._circle_from = 0.0

    @property
    def running(self) -> bool:
        """Tell whether a program runs."""
        return self.cause == RUNNING

    # From outside

    def start(self, program: tuple[str, ...], address: int, now: float) -> None:
        """Run a program from an address that it has."""
        self._calls.clear()
        self._begin(program, address, now, single=False)

    def start_single(self, program: tuple[str, ...], address: int, now: float) -> None:
        """Execute one instruction; subroutines are still known from one to the next."""
        self._begin(program, address, now, single=True)

    def end(self, now: float, *, at_rest: bool = False) -> None:
        """End by UES, `at_rest` only once the motor has stopped; it is the end cause of no program too."""
        self.awake(now)
        if at_rest and self.running and self._machine.motor.moving:
            self._ending, self.next_at = True, None
        else:
            self._end(BY_UES)

    def cut_power(self) -> None:
        """Stop where it is."""
        self._end(self.cause)

    def awake(self, now: float) -> None:
        """Heed that something may have changed."""
        self._trail.clear()
        if self._ending and not self._machine.motor.moving:
            self._end(BY_UES)
        if self._circle:
            rounds = max(0, ceil((now - self._circle_from) / INSTRUCTION_S - _ROUNDING))
            self.address = self._circle[rounds % len(self._circle)]
            self.next_at = max(now, self._circle_from + rounds * INSTRUCTION_S)
            self._circle.clear()

    # In time

    def step(self, now: float) -> bool:
        """Execute the instruction that is due; whether anything but the program's course may have changed."""
        if self._waiting:
            self._waiting = False
            self.address += 1
            if self._single:
                self._end(STEPPED)
                return False
        if self.address in self._trail:
            self._sleep(now)
            return False
        address, self._variables.now = self.address, now
        try:
            instruction = self._present()
            self._go_on(self._execute(instruction, now), now)
        except Ended as ended:
            self._end(ended.cause)
        except (Refused, WireFault):
            self._end(COMMAND_ERROR)
        else:
            if _only_chooses(instruction):
                self._trail[address] = None
                return False
            self._trail.clear()
            return _reaches_out(instruction)
        return False

    def _begin(self, program: tuple[str, ...], address: int, now: float, *, single: bool) -> None:
        if program != self._program:
            self._program, self._instructions = program, tuple(map(parse, program))
            marks = enumerate(self._instructions)
            self._labels = {mark.name: place for place, mark in marks if isinstance(mark, Label)}
        self.address, self.cause, self._single = address, RUNNING, single
        self._trail.clear()
        self.step(now)

    def _present(self) -> Instruction:
        if self.address >= len(self._instructions):
            raise Ended(NO_INSTRUCTION)
        return self._instructions[self.address]

    def _execute(self, instruction: Instruction, now: float) -> Turn:
        if isinstance(instruction, ProgramOperation):
            return operate(instruction, self._variables)
        if isinstance(instruction, Communication):
            self._command(instruction, now)
        return None

    def _command(self, instruction: Communication, now: float) -> None:
        """Do what a host could command; what would be its reply goes into the result buffer."""
        machine, command = self._machine, instruction.command(self._variables.value)
        text = command.code + command.written()
        machine.truth.log("program", now, machine.body, address=self.address, text=text)
        if command.starts_motion and machine.motor.moving:
            raise Ended(MOVE_WHILE_MOVING)
        outcome = machine.perform(order_of(command), now)
        if isinstance(outcome, Reply):
            self._variables.keep_result(_number(outcome.written()))

    def _go_on(self, turn: Turn, now: float) -> None:
        self.next_at = now + INSTRUCTION_S
        if isinstance(turn, Wait):
            self._waiting = True
            self.next_at = max(self.next_at, now + turn.seconds)
            return
        self.address = self._after(turn)
        if self._single:
            self._end(STEPPED)

    def _after(self, turn: Target | Call | Return | None) -> int:
        """The address at which the program goes on."""
        match turn:
            case None:
                return self.address + 1
            case Call(label):
                if len(self._calls) == DEEPEST_CALL:
                    raise Ended(COMMAND_ERROR)
                target = self._found(label)
                self._calls.append(self.address + 1)
                return target
            case Return():
                if not self._calls:
                    raise Ended(COMMAND_ERROR)
                return self._calls.pop()
        return self._found(turn)

    def _found(self, target: Target) -> int:
        """Give the address of a jump's target: that after a label, or at an offset from the present one."""
        if isinstance(target, ToLabel):
            address = self._labels.get(target.name, len(self._instructions)) + 1
        else:
            address = self.address + target.addresses
        if not 0 <= address < len(self._instructions):
            raise Ended(NO_INSTRUCTION)
        return address

    def _sleep(self, now: float) -> None:
        """Wait for something to change: until then the program only goes round."""
        trail = list(self._trail)
        self._circle, self._circle_from = trail[trail.index(self.address) :], now
        self.next_at = None

    def _end(self, cause: int) -> None:
        self.cause, self.next_at = cause, None
        self._waiting = self._ending = False
        self._trail.clear()
        self._circle.clear()


def _only_chooses(instruction: Instruction) -> bool:
    """Tell whether it does nothing but choose the next address, by what does not change with time alone."""
    if isinstance(instruction, ProgramOperation):
        return instruction.row.jumps and not any(map(_runs, instruction.operands))
    return isinstance(instruction, Label)


def _runs(operand: Operand) -> bool:
    return operand == Register("PP") or (isinstance(operand, BankPlace) and operand.bank == "T")


def _reaches_out(instruction: Instruction) -> bool:
    """Tell whether it may change more than the program's memories."""
    if isinstance(instruction, ProgramOperation):
        return any(isinstance(each, BankPlace) and each.bank == "OD" for each in instruction.operands)
    return isinstance(instruction, Communication)


def _number(reply: str) -> int:
    """A reply as the result buffer holds it, decimals cut off."""
    return int(reply[1:], 16) if reply.startswith("H") else int(float(reply))
