"""Jogging a robot's axes over HTTP, with a dead-man: heartbeats keep the axis moving."""

from fastapi import Request, Response
from pydantic import Field

from api.common.problems import DECLARED
from api.common.requests import json_response, new_router, origin, plant_of
from api.common.results import render
from api.robots.names import RobotId
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.fics.jogs import JogSession
from gateway.operations import jogs
from gateway.operations.commands import do
from protocols.fics.jog import StartJog
from protocols.fics.notation import AxisName, Direction, Unit

router = new_router("jogs")


class JogRequest(RequestModel, json_schema_extra=example(unit=2, axis="X", direction="+")):
    """Which axis to jog, and which way (C-HOST manual 2-2)."""

    unit: Unit
    axis: AxisName = Field(description="X Y Z .. for a user axis, A B C .. for a motor axis, @ for theta.")
    direction: Direction


@router.post("/robots/{robot_id}/jogs", Right.OPERATE, status_code=201, response_model=JogSession)
async def start_jog(request: Request, robot_id: RobotId, jog: JogRequest) -> Response:
    """Start to jog an axis. It stops when no heartbeat has come for half a second."""
    command = StartJog(axis=jog.axis, direction=jog.direction)
    target = f"/robots/{robot_id}/units/{jog.unit}"
    return render(request, await do(plant_of(request), origin(), target, command))


@router.post("/robots/{robot_id}/jogs/{jog_id}/heartbeat", Right.OPERATE, response_model=JogSession)
async def keep_jogging(request: Request, robot_id: RobotId, jog_id: str) -> Response:
    """Let the axis move for another half second; 409 when it is being stopped, or nobody can reach it."""
    return json_response(await jogs.heartbeat(plant_of(request), origin(), robot_id, jog_id))


@router.post(
    "/robots/{robot_id}/jogs/{jog_id}/stop",
    Right.STOP,
    response_model=JogSession,
    responses={
        **DECLARED,
        200: {"description": "The axis was seen to stand still."},
        202: {"model": JogSession, "description": "It may still move: the whole robot is being stopped."},
    },
)
async def end_jog(request: Request, robot_id: RobotId, jog_id: str) -> Response:
    """Stop the axis, and answer when it stands still.

    Where that was not seen in time, the state is `stopping` and the whole robot is being stopped; ask again
    until the state is another.
    """
    session = await jogs.end(plant_of(request), origin(), robot_id, jog_id)
    return json_response(session, 202 if session.state == "stopping" else 200)
