"""User programs over HTTP: read, checked and uploaded, run and followed."""

from typing import Annotated, Any, Final, Self

from fastapi import Body, HTTPException, Query, Request, Response
from pydantic import BaseModel, BeforeValidator, Field, ValidationError, model_validator

from api.bodies.names import body_of
from api.common import strict_json
from api.common.documentation import begins
from api.common.faults import InvalidBody
from api.common.problems import DECLARED
from api.common.records import RecordRoutes
from api.common.requests import (
    begun_response,
    json_response,
    new_router,
    origin,
    plant_of,
    wait_headers,
    wait_s,
)
from api.common.strict_json import JSON
from gateway.core.aside import aside
from gateway.core.errors import InvalidRequest
from gateway.core.operation import Wait
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.door.names import BodyId
from gateway.operations import programs
from gateway.rorze.program_runs import ProgramRun, ProgramState
from gateway.rorze.program_uploads import ProgramUpload
from protocols.rorze.programs import Address, Label, RunProgram, StepProgram

router = new_router("programs")

TEXT = "text/plain"
MAX_PROGRAM_BYTES = 262_144
"""A full program of 6039 steps, with comments."""


class Program(BaseModel):
    """The user program that a body holds in RAM."""

    body_id: str
    source: str = Field(description="One instruction a line: line N stands at address N - 1.")
    instructions: int
    steps: int = Field(description="The room it takes, of 6039 steps.")
    labels: dict[str, int] = Field(description="The address of each label.")
    running: bool


class ProgramSource(RequestModel, json_schema_extra=example(source="*TEST\n1+M500 ; to the right\nEND")):
    """A program to be uploaded in the place of the present one."""

    source: str = Field(description="One command a line; comments begin with `;`.")
    flash: bool = Field(default=False, description="Write it to flash memory too (FUS).")


def _named(label: object) -> object:
    return label.removeprefix("*") if isinstance(label, str) else label


class RunRequest(RequestModel, json_schema_extra=example(address=0)):
    """Where a program begins: at a label or an address, else at its first instruction."""

    label: Annotated[Label, BeforeValidator(_named)] | None = Field(
        None, description="With or without its `*`."
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


_SOURCE: Final[dict[str, Any]] = {
    "requestBody": {
        "required": True,
        "content": {JSON: {"schema": ProgramSource.model_json_schema()}},
    }
}
Flash = Annotated[bool, Query(description="For a source in plain text: write it to flash memory too.")]


@router.get(
    "/bodies/{body_id}/program",
    Right.VIEW,
    response_model=Program,
    responses={**DECLARED, 200: {"model": Program, "content": {TEXT: {"schema": {"type": "string"}}}}},
)
async def get_program(request: Request, body_id: BodyId) -> Response:
    """Read the user program from the controller (UED, UPD); with `Accept: text/plain` its text alone."""
    stored = await programs.read(plant_of(request), origin(), body_id)
    accepted = request.headers.get("accept", "").lower()
    if TEXT in accepted and JSON not in accepted:
        return Response(stored.source, media_type=TEXT, headers={"Vary": "Accept"})
    program = Program(
        body_id=body_of(request, body_id).address,
        source=stored.source,
        instructions=len(stored.instructions),
        steps=stored.steps,
        labels=stored.labels,
        running=stored.running,
    )
    return json_response(program, headers={"Vary": "Accept"})


@router.put(
    "/bodies/{body_id}/program",
    Right.SETUP,
    openapi_extra=_SOURCE,
    **begins(ProgramUpload, "The upload is over."),
)
async def upload_program(
    request: Request, body_id: BodyId, flash: Flash = False, wait: Wait = None
) -> Response:
    """Upload a user program (UCS, UWS), read it back and compare it; its source alone may come as text/plain.

    It is assembled first: what is wrong with it is told by line and column, and nothing is sent. Refused
    while the motor moves or a program runs. A stop breaks it off; `stored` says what the body holds then.
    """
    plant, waited_s = plant_of(request), wait_s(request, wait)
    wanted = await _source_of(request)
    # Thousands of lines take a second to assemble, in which no stop may wait.
    program = await aside(programs.check, wanted.source)
    saved = flash or wanted.flash
    upload = await programs.upload(plant, origin(), body_id, program, saved, waited_s)
    return begun_response(upload, f"/bodies/{upload.body_id}/program/uploads", waited_s)


RecordRoutes(
    "an upload",
    ProgramUpload,
    programs.UPLOADS,
    "Cancel the upload under way before its next instruction; what is stored then stays in RAM.",
).add_to(
    router, "/bodies/{body_id}/program/uploads", "get_program_upload", "cancel_program_upload", body_id=BodyId
)


@router.post("/bodies/{body_id}/program/runs", Right.OPERATE, **begins(ProgramRun, "The program has ended."))
async def run_program(
    request: Request,
    body_id: BodyId,
    run: Annotated[RunRequest, Body(default_factory=RunRequest)],
    wait: Wait = None,
) -> Response:
    """Run the user program (URG), or one instruction of it (USG); it may move the motor. A stop ends it."""
    waited_s = wait_s(request, wait)
    begun = await programs.run(plant_of(request), origin(), body_id, run.command(), waited_s)
    return begun_response(begun, f"/bodies/{begun.body_id}/program/runs", waited_s)


@router.get("/bodies/{body_id}/program/runs/current", Right.VIEW, response_model=ProgramState)
async def get_program_state(request: Request, body_id: BodyId) -> Response:
    """Ask the controller whether its program runs, how it ended and where it is (URD, UND, UED, UPD)."""
    return json_response(await programs.state(plant_of(request), origin(), body_id))


@router.get("/bodies/{body_id}/program/runs/{run_id}", Right.VIEW, response_model=ProgramRun)
async def get_program_run(request: Request, body_id: BodyId, run_id: str, wait: Wait = None) -> Response:
    """Get a run that the gateway has started, at once or when it is over."""
    waited_s = wait_s(request, wait)
    run = await programs.get_run(plant_of(request), body_id, run_id, waited_s)
    return json_response(run, headers=wait_headers(waited_s))


async def _source_of(request: Request) -> ProgramSource:
    """Read a program from JSON or plain text.

    :raises HTTPException: 413 or 415, or 400 where it is no JSON.
    :raises InvalidBody: it is another JSON.
    :raises InvalidRequest: it is not to be trusted.
    """
    kind = strict_json.require_type(request, JSON, TEXT)
    content = await strict_json.read_body(request, MAX_PROGRAM_BYTES)
    if kind == TEXT:
        try:
            return ProgramSource(source=content.decode("utf-8-sig"))
        except UnicodeDecodeError:
            raise InvalidRequest("The program is not UTF-8 text; nothing was sent.") from None
    return await aside(_from_json, content)


def _from_json(content: bytes) -> ProgramSource:
    try:
        data = strict_json.parse(content)
    except strict_json.NotStrict as error:
        raise InvalidRequest(f"The request is not valid: {error}; nothing was sent.") from None
    except ValueError:
        raise HTTPException(400, "The request body is not JSON; nothing was sent.") from None
    try:
        return ProgramSource.model_validate(data)
    except ValidationError as error:
        raise InvalidBody(error, data, ProgramSource) from None
