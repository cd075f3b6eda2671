"""User programs of bodies: checked, uploaded, read, run; and the memories they share with their hosts."""

from typing import Final

from gateway.core.errors import InvalidText, Misplaced
from gateway.core.rights import Right
from gateway.operations.caller import address_of, needs, require
from gateway.operations.of_bodies import of_body
from gateway.operations.records import Records
from gateway.plant import Plant
from gateway.rorze import memories, stored_program
from gateway.rorze.bodies import Body
from gateway.rorze.family import Rorze
from gateway.rorze.program_runs import ProgramRun, ProgramState
from gateway.rorze.program_uploads import ProgramUpload, ProgramUploads
from gateway.rorze.stored_program import StoredProgram
from protocols.rorze.programs import RunProgram, StepProgram
from protocols.rorze.user_program.assembler import Assembled, assemble

MOST_TOLD = 100
"""So many faults of a program are told at once."""


def check(source: str) -> Assembled:
    """Assemble a program; nothing is sent.

    :raises InvalidText: it has faults, each with its line and column.
    """
    program = assemble(source)
    if isinstance(program, Assembled):
        return program
    first = program[0]
    faults = [Misplaced(fault.line, fault.column, fault.reason) for fault in program[:MOST_TOLD]]
    more = f" There are {len(program)} faults in all." if len(program) > 1 else ""
    raise InvalidText(
        "source",
        f"Line {first.line}, column {first.column}: {first.reason}{more} Nothing was sent.",
        "Correct the program.",
        faults,
    )


@needs(Right.VIEW)
async def read(plant: Plant, body_id: str) -> StoredProgram:
    """Read the program that a body holds in RAM.

    :raises BodyBusy: one is being uploaded.
    :raises GatewayError: it was not read.
    """
    body = _body(plant, body_id)
    plant.family(Rorze).uploads.require_none(body)
    return await stored_program.read(body)


@needs(Right.SETUP)
async def upload(plant: Plant, body_id: str, program: Assembled, flash: bool, wait_s: float) -> ProgramUpload:
    """Begin to replace a body's program, and give the record after `wait_s` at most.

    Errors as of `ProgramUploads.start`, and `BodyBusy` where a backup is being restored.
    """
    rorze, body = plant.family(Rorze), _body(plant, body_id)
    rorze.restores.require_free(body.address)
    begun = await rorze.uploads.start(body, program, flash=flash)
    await rorze.uploads.wait(begun, wait_s)
    return begun


@needs(Right.OPERATE)
async def run(plant: Plant, body_id: str, command: RunProgram | StepProgram, wait_s: float) -> ProgramRun:
    """Run a body's program, or one instruction of it; errors as of `ProgramRuns.start`."""
    runs, body = plant.family(Rorze).runs, _body(plant, body_id)
    plant.require_unlatched(body.address)
    begun = await runs.start(body, command)
    await runs.wait(begun, wait_s)
    return begun


async def get_run(plant: Plant, body_id: str, run_id: str, wait_s: float) -> ProgramRun:
    """Give a run when it is over, or as it is when the time is up; errors as of `Works.get`."""
    require(plant, Right.VIEW, body_id)
    return await plant.family(Rorze).runs.get(_body(plant, body_id).address, run_id, wait_s)


@needs(Right.VIEW)
async def state(plant: Plant, body_id: str) -> ProgramState:
    """Ask a body where its program is; errors as of `Body.ask`."""
    return await plant.family(Rorze).runs.state(_body(plant, body_id))


read_memories: Final = of_body(Right.VIEW, memories.read)
write_memories: Final = of_body(Right.OPERATE, memories.write)


def _body(plant: Plant, body_id: str) -> Body:
    return plant.family(Rorze).body(body_id)


def _uploads(plant: Plant, path: str) -> tuple[ProgramUploads, str]:
    return plant.family(Rorze).uploads, _body(plant, address_of(path)).address


UPLOADS: Final = Records(_uploads, Right.SETUP)
