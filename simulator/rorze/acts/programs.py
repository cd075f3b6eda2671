"""User programs: commands U (RC-420 manual 14, 15)."""

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
    GetProgramAddress,
    GetProgramAutostart,
    GetProgramInstruction,
    GetProgramLine,
    GetProgramMemory,
    GetProgramStatus,
    MemoryReply,
    PlaceQuery,
    ProgramInstruction,
    ProgramLine,
    ProgramStatus,
    RunProgram,
    SetProgramAutostart,
    SetProgramMemory,
    StepProgram,
)
from protocols.rorze.stops import StopDecelerating, StopImmediately
from protocols.rorze.user_program.instruction import InstructionFault, Label, parse
from simulator.rorze.actions import BAD_PARAMETER, Refused, acts_out
from simulator.rorze.acts.kept import keeps
from simulator.rorze.acts.stops import stop_decelerating, stop_immediately
from simulator.rorze.axis import held
from simulator.rorze.controller import Rc420
from simulator.rorze.program_memory import fits, free_steps
from simulator.rorze.variables import as_bits, as_number

ALREADY_RUNNING, NO_SUCH_PLACE = 0x5A, 0x5B
"""The latter: nothing is there, or there is no room."""


def require_no_run(axis: Rc420) -> None:
    """Require that no program runs, before one is changed or started.

    :raises Refused: 5A while a program runs.
    """
    if axis.run.running:
        raise Refused(ALREADY_RUNNING)


# Running


@acts_out(RunProgram)
def _run(axis: Rc420, command: RunProgram, now: float) -> None:
    require_no_run(axis)
    axis.run.start(axis.program, _start_of(axis, command, 0), now)


@acts_out(StepProgram)
def _step(axis: Rc420, command: StepProgram, now: float) -> None:
    require_no_run(axis)
    axis.run.start_single(axis.program, _start_of(axis, command, axis.run.address), now)


def _start_of(axis: Rc420, command: RunProgram | StepProgram, default: int) -> int:
    """Where to begin: after a label, at an address, or at the default.

    :raises Refused: 5B where nothing stands there.
    """
    address = default if command.address is None else command.address
    if command.label is not None:
        address = _address_of(axis, command.label) + 1
    if address >= len(axis.program):
        raise Refused(NO_SUCH_PLACE)
    return address


@acts_out(EndProgram)
def _end_program(axis: Rc420, command: EndProgram, now: float) -> None:
    if command.motor == "stop_immediately":
        stop_immediately(axis, StopImmediately(), now)
    elif command.motor == "stop_decelerating":
        stop_decelerating(axis, StopDecelerating(), now)
    axis.run.end(now, at_rest=command.motor == "stop_decelerating")


@acts_out(GetProgramStatus)
def _get_program_status(axis: Rc420, _: GetProgramStatus, now: float) -> ProgramStatus:
    return ProgramStatus(status=axis.run.cause)


@acts_out(GetProgramAddress)
def _get_address(axis: Rc420, _: GetProgramAddress, now: float) -> AddressReply:
    return AddressReply(address=min(axis.run.address, LAST_ADDRESS))


keeps(GetProgramAutostart, SetProgramAutostart, "autostart")


# Instructions


@acts_out(AddProgramInstruction)
def _add_instruction(axis: Rc420, command: AddProgramInstruction, now: float) -> None:
    """Reject what no program knows, and a label a second time (15.2.3): with 4A, an assumption."""
    require_no_run(axis)
    instruction = command.instruction
    try:
        known = parse(instruction)
    except InstructionFault:
        raise Refused(BAD_PARAMETER) from None
    if isinstance(known, Label) and instruction in axis.program:
        raise Refused(BAD_PARAMETER)
    if not fits(axis.program, instruction):
        raise Refused(NO_SUCH_PLACE)
    axis.program = (*axis.program, instruction)


@acts_out(ClearProgram)
def _clear_program(axis: Rc420, command: ClearProgram, now: float) -> None:
    require_no_run(axis)
    axis.program = ()


@acts_out(GetFreeProgramSteps)
def _get_free_steps(axis: Rc420, command: GetFreeProgramSteps, now: float) -> FreeSteps:
    return FreeSteps(steps=free_steps(axis.program))


@acts_out(GetLastProgramAddress)
def _get_last_address(axis: Rc420, command: GetLastProgramAddress, now: float) -> AddressReply:
    """That of the next instruction to be stored (15.2.6); the last there is where no more fits."""
    return AddressReply(address=min(len(axis.program), LAST_ADDRESS))


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
        address = _address_of(axis, query.label) + axis.labels_lead_on
    if not axis.program or address > LAST_ADDRESS:
        raise Refused(NO_SUCH_PLACE)
    axis.next_program_address = address + 1
    return address


def _address_of(axis: Rc420, label: str) -> int:
    """The address of a label; one that no program has, if it is not there."""
    mark = f"*{label}"
    return axis.program.index(mark) if mark in axis.program else STEPS


def _instruction_at(axis: Rc420, address: int) -> str | None:
    return axis.program[address] if address < len(axis.program) else None


# Memories


@acts_out(GetProgramMemory)
def _get_memory(axis: Rc420, command: GetProgramMemory, now: float) -> MemoryReply:
    value = axis.memories.get(command.memory, now)
    return MemoryReply(value=held(value)) if command.notation is None else MemoryReply(bits=as_bits(value))


@acts_out(SetProgramMemory)
def _set_memory(axis: Rc420, command: SetProgramMemory, now: float) -> None:
    """Bits are those of a number with a sign, an assumption."""
    if command.value is not None:
        axis.memories.set(command.memory, command.value, now)
    elif command.bits is not None:
        axis.memories.set(command.memory, as_number(command.bits), now)
