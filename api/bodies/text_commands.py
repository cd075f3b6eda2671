"""Commands as plain text, where the configuration allows it: the same scheduler, the same rules."""

from typing import Annotated, Any, cast

from fastapi import Request, Response
from pydantic import BaseModel, Field

from api.common.idempotency import require_no_key
from api.common.problems import DECLARED
from api.common.requests import (
    BodyId,
    Wait,
    age_ms_of,
    json_response,
    new_router,
    origin,
    plant_of,
    wait_s,
)
from api.common.results import StopResult, render
from api.common.strict_json import StrictRoute
from gateway.core.move_record import Move
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.targets import Answer
from gateway.operations.commands import do, read_text
from gateway.rorze.family import Rorze
from protocols.rorze.row import RorzeCommand
from protocols.table import Effect


class TextRoute(StrictRoute):
    """A route that knows only when it has read its body whether that is a stop."""

    refuses_keys = False


router = new_router("commands", TextRoute)


class RawRequest(RequestModel, json_schema_extra=example(text="6PD")):
    """A command as it stands on the line, without introducer, body number and CR."""

    text: Annotated[str, Field(pattern=r"^[0-9A-Z*+/-]{3}[ -%'-~]*$", max_length=58, examples=["6PD"])]


class RawReply(BaseModel):
    """What was answered."""

    body_id: str
    sent: str = Field(description="The exact bytes, CR as \\r.")
    reply: str = Field(description="What followed the code in the reply.")
    age_ms: float


@router.post(
    "/bodies/{body_id}/raw",
    Right.SETUP,
    response_model=RawReply | StopResult,
    responses={
        **DECLARED,
        202: {"model": Move, "description": "The command has started a move."},
    },
)
async def send_raw(request: Request, body_id: BodyId, raw: RawRequest, wait: Wait = None) -> Response:
    """Send a command as text. A command that moves makes a move, and one that stops makes a stop."""
    plant, target = plant_of(request), f"/bodies/{body_id}"
    command = read_text(plant, target, raw.text)
    if command.effect is not Effect.STOP:
        require_no_key(request)
    waited_s = wait_s(request, wait)
    result = await do(plant, origin(), target, command, waited_s)
    if not isinstance(result, Answer):
        return render(request, result, waited_s)
    body = plant.family(Rorze).body(body_id)
    return json_response(
        RawReply(
            body_id=body.address,
            sent=body.line.frame_of(body.number, cast("RorzeCommand[Any]", command)),
            reply=result.replies[0].written(),
            age_ms=age_ms_of(result.at or 0.0),
        )
    )
