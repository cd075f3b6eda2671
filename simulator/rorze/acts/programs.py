"""User programs: of command U (RC-420 manual 15), only what a controller without a program can say and do."""

from protocols.rorze.programs import EndProgram, GetProgramStatus, ProgramStatus
from protocols.rorze.stops import StopDecelerating, StopImmediately
from simulator.rorze.actions import acts_out
from simulator.rorze.acts.stops import stop_decelerating, stop_immediately
from simulator.rorze.controller import Rc420

NEVER_RUN = 0x00


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
