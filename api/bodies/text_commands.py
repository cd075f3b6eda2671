"""Commands to bodies as plain text, where the configuration allows it."""

from functools import partial

from fastapi import Request, Response

from api.bodies.names import body_of
from api.common.problems import DECLARED
from api.common.requests import new_router
from api.common.text_commands import TextRoute, send_text
from gateway.core.move_record import Move
from gateway.core.operation import Wait
from gateway.core.rights import Right
from gateway.door.names import BodyId
from gateway.door.results import StopResult
from gateway.door.text_commands import RawReply, RawRequest, told_by_body

router = new_router("commands", TextRoute)


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
    told = partial(told_by_body, body_of(request, body_id))
    return await send_text(request, f"/bodies/{body_id}", raw.text, wait, told)
