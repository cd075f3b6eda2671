"""Moves of robots over HTTP: started, planned, listed and waited for; macros run as moves."""

from typing import Annotated

from fastapi import Body, Path, Query, Request, Response
from pydantic import BaseModel, Field

from api.common.documentation import begins_moves
from api.common.requests import json_response, new_router, origin, plant_of, wait_headers, wait_s
from api.common.results import render
from api.robots.names import RobotId, UnitNumber
from gateway.core.operation import Wait
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.fics.move_record import RobotMove
from gateway.fics.move_requests import RobotMoveRequest
from gateway.fics.plans import PlannedRobotMove
from gateway.operations import moves
from gateway.operations.commands import do
from protocols.fics.macros import Arguments, MacroName, RunMacro
from protocols.fics.notation import Unit

router = new_router("robot moves")

UNIT = "/robots/{robot_id}/units/{unit}"


class MacroRunRequest(RequestModel, json_schema_extra=example(unit=1, arguments=[150, 140, -5])):
    """How to run a macro (C-HOST manual 1-7)."""

    unit: Unit | None = Field(
        default=None, description="The unit that is selected while it runs; left out, the only one."
    )
    arguments: Arguments | None = Field(default=None, description="Up to four numbers; null leaves one out.")


class RobotMoveList(BaseModel):
    """Moves of a unit, newest first."""

    moves: list[RobotMove]


@router.post(f"{UNIT}/moves", Right.OPERATE, **begins_moves(UNIT, RobotMove, RobotMove | PlannedRobotMove))
async def start_robot_move(
    request: Request, robot_id: RobotId, unit: UnitNumber, move: RobotMoveRequest, wait: Wait = None
) -> Response:
    """Start a move of a unit, or with `validate_only` say what it would be.

    202 when the robot has not refused it and it is not over, 200 when it ended while the request waited. A
    move that has started and failed is no HTTP error: see its `status`, `end_cause` and `error`.
    """
    waited_s, target = wait_s(request, wait), f"/robots/{robot_id}/units/{unit}"
    begun = await moves.start(plant_of(request), origin(), target, move, waited_s)
    return render(request, begun, waited_s)


@router.get("/robots/{robot_id}/units/{unit}/moves", Right.VIEW, response_model=RobotMoveList)
async def list_robot_moves(
    request: Request,
    robot_id: RobotId,
    unit: UnitNumber,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> Response:
    """List the unit's moves, newest first."""
    newest = moves.newest(plant_of(request), f"/robots/{robot_id}/units/{unit}", limit)
    return json_response(RobotMoveList(moves=newest))


@router.get("/robots/{robot_id}/units/{unit}/moves/{move_id}", Right.VIEW, response_model=RobotMove)
async def get_robot_move(
    request: Request, robot_id: RobotId, unit: UnitNumber, move_id: str, wait: Wait = None
) -> Response:
    """Get a move, at once or when it is over."""
    waited_s, target = wait_s(request, wait), f"/robots/{robot_id}/units/{unit}"
    move = await moves.get(plant_of(request), target, move_id, waited_s)
    return json_response(move, headers=wait_headers(waited_s))


@router.post("/robots/{robot_id}/macros/{name}/runs", Right.OPERATE, **begins_moves(UNIT, RobotMove))
async def run_macro(
    request: Request,
    robot_id: RobotId,
    name: Annotated[MacroName, Path(description="Three capital letters or digits.", examples=["PCK"])],
    run: Annotated[MacroRunRequest, Body(default_factory=MacroRunRequest)],
    wait: Wait = None,
) -> Response:
    """Run a macro of the robot; the run is a move of the unit it is started on."""
    waited_s = wait_s(request, wait)
    target = f"/robots/{robot_id}" + ("" if run.unit is None else f"/units/{run.unit}")
    command = RunMacro(macro=name, arguments=run.arguments)
    return render(request, await do(plant_of(request), origin(), target, command, waited_s), waited_s)
