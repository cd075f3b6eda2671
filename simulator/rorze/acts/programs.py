"""User programs: commands U (RC-420 manual 14, 15). Programs are kept and told, but none is ever run."""

from protocols.rorze.programs import (
    LAST_ADDRESS,
    STEPS,
    AddProgramInstruction,
    AddressReply,
    ClearProgram,
    EndProgram,
    FreeSteps,
    GetFreeProgramSteps,
    GetLastProgramAddress,
    GetProgramInstruction,
    GetProgramLine,
    GetProgramMemory,
    GetProgramStatus,
    MemoryReply,
    PlaceQuery,
    ProgramInstruction,
    ProgramLine,
    ProgramStatus,
    SetProgramMemory,
)
from protocols.rorze.stops import StopDecelerating, StopImmediately
from simulator.rorze.actions import BAD_PARAMETER, Refused, acts_out
from simulator.rorze.acts.stops import stop_decelerating, stop_immediately
from simulator.rorze.axis import held
from simulator.rorze.controller import Rc420
from simulator.rorze.program_memory import fits, free_steps, steps_of

NEVER_RUN = 0x00
NO_SUCH_PLACE = 0x5B
"""Nothing is there, or there is no room."""

BITS = 1 << 32


@acts_out(GetProgramStatus)
def _get_program_status(axis: Rc420, _: GetProgramStatus, now: float) -> ProgramStatus:
    return ProgramStatus(status=NEVER_RUN)


@acts_out(EndProgram)
def _end_program(axis: Rc420, command: EndProgram, now: float) -> None:
    """Stop the motor as asked; there is no program to end."""
    if command.motor == "stop_immediately":
        stop_immediately(axis, StopImmediately(), now)
    elif command.motor == "stop_decelerating":
        stop_decelerating(axis, StopDecelerating(), now)


# Instructions


@acts_out(AddProgramInstruction)
def _add_instruction(axis: Rc420, command: AddProgramInstruction, now: float) -> None:
    """Reject what no program knows, and a label a second time (15.2.3): with 4A, an assumption."""
    instruction = command.instruction
    if steps_of(instruction) is None or (instruction.startswith("*") and instruction in axis.program):
        raise Refused(BAD_PARAMETER)
    if not fits(axis.program, instruction):
        raise Refused(NO_SUCH_PLACE)
    axis.program = (*axis.program, instruction)


@acts_out(ClearProgram)
def _clear_program(axis: Rc420, command: ClearProgram, now: float) -> None:
    axis.program = ()


@acts_out(GetFreeProgramSteps)
def _get_free_steps(axis: Rc420, command: GetFreeProgramSteps, now: float) -> FreeSteps:
    return FreeSteps(steps=free_steps(axis.program))


@acts_out(GetLastProgramAddress)
def _get_last_address(axis: Rc420, command: GetLastProgramAddress, now: float) -> AddressReply:
    """0 for no program too, an assumption."""
    return AddressReply(address=max(0, len(axis.program) - 1))


@acts_out(GetProgramInstruction)
def _get_instruction(axis: Rc420, command: GetProgramInstruction, now: float) -> ProgramInstruction:
    return ProgramInstruction(instruction=_instruction_at(axis, _place(axis, command)))


@acts_out(GetProgramLine)
def _get_line(axis: Rc420, command: GetProgramLine, now: float) -> ProgramLine:
    address = _place(axis, command)
    return ProgramLine(address=address, instruction=_instruction_at(axis, address))


def _place(axis: Rc420, query: PlaceQuery[ProgramInstruction] | PlaceQuery[ProgramLine]) -> int:
    """The address meant; the question after it means the next one.

    :raises Refused: 5B without a program, for an unknown label, and after the last address.
    """
    address = axis.next_program_address if query.address is None else query.address
    if query.label is not None:
        label = f"*{query.label}"
        address = axis.program.index(label) if label in axis.program else STEPS
    if not axis.program or address > LAST_ADDRESS:
        raise Refused(NO_SUCH_PLACE)
    axis.next_program_address = address + 1
    return address


def _instruction_at(axis: Rc420, address: int) -> str | None:
    return axis.program[address] if address < len(axis.program) else None


# Memories


@acts_out(GetProgramMemory)
def _get_memory(axis: Rc420, command: GetProgramMemory, now: float) -> MemoryReply:
    value = axis.memories.get(command.memory, now)
    return MemoryReply(value=held(value)) if command.notation is None else MemoryReply(bits=value % BITS)


@acts_out(SetProgramMemory)
def _set_memory(axis: Rc420, command: SetProgramMemory, now: float) -> None:
    """Bits are those of a number with a sign, an assumption."""
    if command.value is not None:
        axis.memories.set(command.memory, command.value, now)
    elif command.bits is not None:
        axis.memories.set(command.memory, (command.bits + BITS // 2) % BITS - BITS // 2, now)
