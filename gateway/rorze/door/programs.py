"""User programs: read, checked and uploaded, run and followed."""

from typing import Annotated, Any, Final, Self

from pydantic import BeforeValidator, Field, model_validator

from gateway.core.aside import aside
from gateway.core.errors import InvalidText, Misplaced
from gateway.core.operation import Rows, Wait
from gateway.core.records import AnswerModel, RequestModel, SentBack, example
from gateway.core.rights import Right
from gateway.core.works import Jobs
from gateway.door.records import list_records
from gateway.plant import Plant
from gateway.rorze import stored_program
from gateway.rorze.bodies import Body
from gateway.rorze.family import Rorze
from gateway.rorze.program_runs import ProgramRun, ProgramState
from gateway.rorze.program_uploads import ProgramUpload
from protocols.rorze.programs import Address, Label, RunProgram, StepProgram
from protocols.rorze.user_program.assembler import Assembled, assemble
from protocols.table import Effect

ROWS: Final = Rows("programs")
MAX_PROGRAM_BYTES: Final = 262_144
"""A full program of 6039 steps, with comments."""
MOST_TOLD: Final = 100
"""Faults of a program that are told at once."""
Flash = Annotated[bool, Field(description="Size in bytes of a full program of 6039 steps, with comments.")]


class Program(AnswerModel):
    """The user program that a body holds in RAM."""

    body_id: str
    source: str = Field(description="One instruction a line: line N stands at address N - 1.")
    instructions: int
    steps: int = Field(description="The room it takes, of 6039 steps.")
    labels: dict[str, int] = Field(description="The address of each label.")
    running: bool


class ProgramSource(SentBack, json_schema_extra=example(source="*TEST\n1+M500 ; to the right\nEND")):
    """A program to be uploaded in the place of the present one."""

    read_only = frozenset(("body_id", "instructions", "labels"))
    passing = frozenset(("steps", "running"))

    source: str = Field(description="One command a line; comments begin with `;`.")
    flash: bool = Field(default=False, description="Write it to flash memory too (FUS).")


def _named(label: object) -> object:
    return label.removeprefix("*") if isinstance(label, str) else label


class RunRequest(RequestModel, json_schema_extra=example(address=0)):
    """Where a program begins: at a label or an address, else at its first instruction."""

    label: Annotated[Label, BeforeValidator(_named)] | None = Field(
        None, description="Label with or without its `*`."
    )
    address: Address | None = None
    single_step: bool = Field(
        False, description="Execute one instruction only; without label and address the next one."
    )

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if self.label is not None and self.address is not None:
            raise ValueError("give label or address, not both")
        return self

    def command(self) -> RunProgram | StepProgram:
        """The controller's command for it."""
        row = StepProgram if self.single_step else RunProgram
        return row(label=self.label, address=self.address)


FROM_THE_BEGIN: Final = RunRequest()


@ROWS.get("/bodies/{body_id}/program", plain="source")
async def get_program(rorze: Rorze, body: Body) -> Program:
    """Read the user program from the controller (UED, UPD); with `Accept: text/plain` its text alone."""
    rorze.uploads.require_none(body)
    stored = await stored_program.read(body)
    return Program(
        body_id=body.address,
        source=stored.source,
        instructions=len(stored.instructions),
        steps=stored.steps,
        labels=stored.labels,
        running=stored.running,
    )


@ROWS.put(
    "/bodies/{body_id}/program",
    Right.SETUP,
    over="The upload is over.",
    kept_at="/bodies/{body_id}/program/uploads",
    plain="source",
    most_bytes=MAX_PROGRAM_BYTES,
)
async def upload_program(
    rorze: Rorze, body: Body, program: ProgramSource, *, flash: Flash = False, wait: Wait = None
) -> ProgramUpload:
    """Upload a user program (UCS, UWS), read it back and compare it; its source alone may come as text/plain.

    It is assembled first: what is wrong with it is told by line and column, and nothing is sent. Refused
    while the motor moves or a program runs. A stop breaks it off; `stored` says what the body holds then.
    """
    # Thousands of lines take a second to assemble, in which no stop may wait.
    assembled = await aside(check, program.source)
    program.require_unchanged(
        Program(
            body_id=body.address,
            source=program.source,
            instructions=len(assembled.instructions),
            steps=assembled.steps,
            labels=dict(assembled.labels),
            running=False,
        )
    )
    rorze.restores.require_free(body.address)
    begun = await rorze.uploads.start(body, assembled, flash=flash or program.flash)
    await rorze.uploads.wait(begun, wait or 0.0)
    return begun


def _uploads(plant: Plant, body_id: str) -> tuple[Jobs[Any], str]:
    rorze = plant.family(Rorze)
    return rorze.uploads, rorze.body(body_id).address


list_records(
    ROWS,
    "/bodies/{body_id}/program/uploads",
    ProgramUpload,
    _uploads,
    one="an upload",
    names=("get_program_upload", "cancel_program_upload"),
    cancelled="Cancel the upload under way before its next instruction; what is stored then stays in RAM.",
)


@ROWS.post(
    "/bodies/{body_id}/program/runs", Right.OPERATE, effect=Effect.MOTION, over="The program has ended."
)
async def run_program(
    plant: Plant,
    body: Body,
    run: RunRequest = FROM_THE_BEGIN,
    *,
    wait: Wait = None,
) -> ProgramRun:
    """Run the user program (URG), or one instruction of it (USG); it may move the motor. A stop ends it."""
    plant.require_unlatched(body.address)
    runs = plant.family(Rorze).runs
    begun = await runs.start(body, run.command())
    await runs.wait(begun, wait or 0.0)
    return begun


@ROWS.get("/bodies/{body_id}/program/runs/current")
async def get_program_state(rorze: Rorze, body: Body) -> ProgramState:
    """Ask the controller whether its program runs, how it ended and where it is (URD, UND, UED, UPD)."""
    return await rorze.runs.state(body)


@ROWS.get("/bodies/{body_id}/program/runs/{run_id}")
async def get_program_run(rorze: Rorze, body: Body, run_id: str, *, wait: Wait = None) -> ProgramRun:
    """Get a run that the gateway has started, at once or when it is over."""
    return await rorze.runs.get(body.address, run_id, wait or 0.0)


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
