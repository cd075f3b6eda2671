"""Moves over HTTP: started, planned, listed and waited for."""

from typing import Annotated, Any

from fastapi import Query, Request, Response
from pydantic import BaseModel

from api.bodies.info import SpeedRequest
from api.common.documentation import begins_moves
from api.common.requests import json_response, new_router, origin, plant_of, wait_headers, wait_s
from api.common.results import GroupMove, render
from gateway.core.move_record import Move
from gateway.core.operation import Wait
from gateway.core.rights import Right
from gateway.door.names import BodyId, GroupId
from gateway.operations import moves
from gateway.rorze.move_requests import MoveRequest
from gateway.rorze.plans import GroupPlan, PlannedMove

router = new_router("moves")


class MoveList(BaseModel):
    """Moves of a body, newest first."""

    moves: list[Move]


@router.post(
    "/bodies/{body_id}/moves", Right.OPERATE, **begins_moves("/bodies/{body_id}", Move, Move | PlannedMove)
)
async def start_move(request: Request, body_id: BodyId, move: MoveRequest, wait: Wait = None) -> Response:
    """Start a move, or with `validate_only` say what it would be.

    202 when the controller has accepted it and it is not over, 200 when it ended while the request waited. A
    move that has started and failed is no HTTP error: see its `status`, `end_cause` and `error`.
    """
    return await perform(request, f"/bodies/{body_id}", move, wait)


@router.get("/bodies/{body_id}/moves", Right.VIEW, response_model=MoveList)
async def list_moves(
    request: Request, body_id: BodyId, limit: Annotated[int, Query(ge=1, le=1000)] = 100
) -> Response:
    """List the body's moves, newest first."""
    return json_response(MoveList(moves=moves.newest(plant_of(request), f"/bodies/{body_id}", limit)))


@router.get("/bodies/{body_id}/moves/{move_id}", Right.VIEW, response_model=Move)
async def get_move(request: Request, body_id: BodyId, move_id: str, wait: Wait = None) -> Response:
    """Get a move, at once or when it is over."""
    waited_s = wait_s(request, wait)
    move = await moves.get(plant_of(request), f"/bodies/{body_id}", move_id, waited_s)
    return json_response(move, headers=wait_headers(waited_s))


@router.post("/bodies/{body_id}/moves/{move_id}/speed", Right.OPERATE, response_model=Move)
async def change_speed_of_one_move(
    request: Request, body_id: BodyId, move_id: str, speed: SpeedRequest
) -> Response:
    """Change the speed of this move on its way (5AS, 5CS, 5DS); 409 when it is over, or homes."""
    plant, target = plant_of(request), f"/bodies/{body_id}"
    return json_response(await moves.change_speed(plant, origin(), target, move_id, speed.command()))


@router.post(
    "/groups/{group_id}/moves",
    Right.OPERATE,
    **begins_moves("/groups/{group_id}", GroupMove, GroupMove | GroupPlan),
)
async def start_group_move(
    request: Request, group_id: GroupId, move: MoveRequest, wait: Wait = None
) -> Response:
    """Start a move of all members of a group by one command; each has a move of its own."""
    return await perform(request, f"/groups/{group_id}", move, wait)


async def perform(request: Request, target: str, move: Any, wait: float | None) -> Response:
    """Start a move of what stands at a path, or say what it would be."""
    waited_s = wait_s(request, wait)
    begun = await moves.start(plant_of(request), origin(), target, move, waited_s)
    return render(request, begun, waited_s)
