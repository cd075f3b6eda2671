"""Commands to bodies as plain text, where the configuration allows it."""

from typing import Annotated, Any

from fastapi import Request, Response
from pydantic import BaseModel, Field

from api.bodies.names import body_of
from api.common.problems import DECLARED
from api.common.requests import new_router
from api.common.text_commands import TextRoute, send_text
from gateway.core.move_record import Move
from gateway.core.operation import Wait
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.targets import Answer
from gateway.core.times import age_ms_of
from gateway.door.names import BodyId
from gateway.door.results import StopResult
from protocols.rorze.row import RorzeCommand

router = new_router("commands", TextRoute)


class RawRequest(RequestModel, json_schema_extra=example(text="6PD")):
    """A command as it stands on the line, without introducer, body number and CR."""

    text: Annotated[str, Field(pattern=r"^[0-9A-Z*+/-]{3}[ -%'-~]*$", max_length=58, examples=["6PD"])]


class RawReply(BaseModel):
    """What was answered."""

    body_id: str
    sent: str = Field(description="The exact bytes, CR as \\r.")
    reply: str = Field(description="What followed the code in the reply, as it came.")
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

    def told(command: RorzeCommand[Any], answer: Answer) -> RawReply:
        body = body_of(request, body_id)
        return RawReply(
            body_id=body.address,
            sent=body.line.frame_of(body.number, command),
            reply=answer.texts[0],
            age_ms=age_ms_of(answer.at or 0.0),
        )

    return await send_text(request, f"/bodies/{body_id}", raw.text, wait, told)
