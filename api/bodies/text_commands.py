"""Commands as plain text, where the configuration allows it: the same scheduler, the same rules."""

import types
from functools import lru_cache
from typing import Annotated, Any

from fastapi import Request, Response
from pydantic import BaseModel, Field

from api.bodies.command_routes import STOP_MODES
from api.bodies.moves import perform
from api.common.idempotency import require_no_key
from api.common.problems import DECLARED
from api.common.requests import (
    BodyId,
    RequestModel,
    Wait,
    age_ms_of,
    example,
    json_response,
    new_router,
    plant_of,
)
from api.common.strict_json import StrictRoute
from api.stops import StopResult, perform_stop
from gateway.core.errors import InvalidRequest, NotAllowed
from gateway.core.move_record import Move
from gateway.core.rights import Right
from protocols.rorze.commands import COMMANDS
from protocols.rorze.notation import Text
from protocols.rorze.row import RorzeCommand
from protocols.table import Effect, Reply, Retry, WireFault


class TextRoute(StrictRoute):
    """A route that knows only when it has read its body whether that is a stop."""

    refuses_keys = False


router = new_router("commands", TextRoute)

CODE_LENGTH = 3


class RawRequest(RequestModel, json_schema_extra=example(text="6PD")):
    """A command as it stands on the line, without introducer, body number and CR."""

    text: Annotated[str, Field(pattern=r"^[0-9A-Z*+/-]{3}[ -%'-~]*$", max_length=58, examples=["6PD"])]


class RawReply(BaseModel):
    """What was answered."""

    body_id: str
    sent: str = Field(description="The exact bytes, CR as \\r.")
    reply: str = Field(description="What followed the code in the reply.")
    age_ms: float


class VerbatimReply(Reply, args="{text}"):
    """A reply of which nothing is known."""

    text: Annotated[str, Text("[ -~]*")]


class Verbatim(
    RorzeCommand[VerbatimReply],
    args="{text}",
    errors=frozenset({0x23, 0x49, 0x4A, 0x5D}),
    retry=Retry.NEVER,
    starts=False,
):
    """A command that is not in the table: it is sent as it was written, once."""

    text: Annotated[str, Text("[ -%'-~]*")]


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
    plant = plant_of(request)
    if not plant.config.server.raw_commands:
        raise NotAllowed(
            "Plain text commands are switched off; nothing was sent.",
            "Use the command's own route, or set raw_commands in the configuration.",
        )
    body = plant.body(body_id)
    command = _read(raw.text)
    if command.effect is not Effect.STOP:
        require_no_key(request)
    if command.starts_motion():
        return await perform(request, body, command, wait)
    if command.code in STOP_MODES:
        return await perform_stop(request, [body], STOP_MODES[command.code])
    reply, answered = await body.ask(command)
    return json_response(
        RawReply(
            body_id=body.address,
            sent=body.line.frame_of(body.number, command),
            reply=reply.written(),
            age_ms=age_ms_of(answered.at),
        )
    )


def _read(text: str) -> RorzeCommand[Any]:
    """Recognise a command of the table, so that the table's rules hold for it; others stay text."""
    code, parameters = text[:CODE_LENGTH], text[CODE_LENGTH:]
    row = COMMANDS.get(code)
    if row is None:
        return _verbatim(code)(text=parameters)
    try:
        return row.read(parameters)
    except WireFault as error:
        raise InvalidRequest(f"{code}: {error}; nothing was sent.", "Write it as the manual does.") from None


@lru_cache(maxsize=64)
def _verbatim(code: str) -> type[Verbatim]:
    row: type[Verbatim] = types.new_class(
        "Verbatim",
        (Verbatim,),
        {"code": code, "args": "{text}"},
        lambda body: body.update(__module__=__name__),
    )
    return row
