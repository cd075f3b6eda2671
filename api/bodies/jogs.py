"""Jogging a body over HTTP, with a dead-man: heartbeats keep the motor moving."""

from fastapi import Request, Response

from api.common.problems import DECLARED
from api.common.requests import json_response, new_router, origin, plant_of
from api.common.results import render
from gateway.core.rights import Right
from gateway.door.names import BodyId
from gateway.operations import body_jogs
from gateway.rorze.jogs import BodyJog, BodyJogRequest

router = new_router("jogs")


@router.post("/bodies/{body_id}/jogs", Right.OPERATE, status_code=201, response_model=BodyJog)
async def start_body_jog(request: Request, body_id: BodyId, jog: BodyJogRequest) -> Response:
    """Start to jog a body. It stops when no heartbeat has come for half a second.

    It is a move of the same id, no further than `at_most`, 10 s at its top speed, or a soft limit.
    """
    return render(request, await body_jogs.start(plant_of(request), origin(), body_id, jog))


@router.post("/bodies/{body_id}/jogs/{jog_id}/heartbeat", Right.OPERATE, response_model=BodyJog)
async def keep_jogging_body(request: Request, body_id: BodyId, jog_id: str) -> Response:
    """Let the motor move for another half second; 409 when it is being stopped, or nobody can reach it."""
    return json_response(await body_jogs.heartbeat(plant_of(request), origin(), body_id, jog_id))


@router.post(
    "/bodies/{body_id}/jogs/{jog_id}/stop",
    Right.STOP,
    response_model=BodyJog,
    responses={
        **DECLARED,
        200: {"description": "The motor was seen to stand still."},
        202: {"model": BodyJog, "description": "It may still move: the stop is repeated."},
    },
)
async def end_body_jog(request: Request, body_id: BodyId, jog_id: str) -> Response:
    """Stop the motor, and answer when it stands still.

    Where that was not seen in time, the state is `stopping`; ask again until the state is another.
    """
    jog = await body_jogs.end(plant_of(request), origin(), body_id, jog_id)
    return json_response(jog, 202 if jog.state == "stopping" else 200)
