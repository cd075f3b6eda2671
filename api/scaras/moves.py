"""Moves of SCARA robots over HTTP: started, planned, listed and waited for."""

from typing import Annotated

from fastapi import Query, Request, Response
from pydantic import BaseModel

from api.common.documentation import begins_moves
from api.common.requests import json_response, new_router, origin, plant_of, wait_headers, wait_s
from api.scaras.names import ScaraId
from gateway.core.operation import Wait
from gateway.core.rights import Right
from gateway.operations import moves, scaras
from gateway.rorze.scaras.record import PlannedScaraMove, ScaraMove
from gateway.rorze.scaras.requests import ScaraMoveRequest

router = new_router("scara moves")


class ScaraMoveList(BaseModel):
    """Moves of a robot, newest first."""

    moves: list[ScaraMove]


@router.post(
    "/scaras/{scara_id}/moves",
    Right.OPERATE,
    **begins_moves("/scaras/{scara_id}", ScaraMove, ScaraMove | PlannedScaraMove),
)
async def start_scara_move(
    request: Request, scara_id: ScaraId, move: ScaraMoveRequest, wait: Wait = None
) -> Response:
    """Start a move of all axes, or with `validate_only` say what it would be.

    In one undivided turn of the line the gateway reads where the axes stand (6PD), tells all controllers
    (HPS), prepares the move, sees that they agree and that nothing has moved, and starts it by one frame
    (HMM; HFM and HNM for `finger` and `align`). 202 when it is accepted and not over, 200 when it ended while
    the request waited. When one axis fails all are stopped: see `status`, `failed_axes` and `error`.
    """
    waited_s = wait_s(request, wait)
    begun = await scaras.start_move(plant_of(request), origin(), scara_id, move, waited_s)
    if isinstance(begun, PlannedScaraMove):
        return json_response(begun)
    headers = {"Location": f"/scaras/{begun.scara_id}/moves/{begun.id}", **wait_headers(waited_s)}
    return json_response(begun, 200 if begun.status.final else 202, headers)


@router.get("/scaras/{scara_id}/moves", Right.VIEW, response_model=ScaraMoveList)
async def list_scara_moves(
    request: Request, scara_id: ScaraId, limit: Annotated[int, Query(ge=1, le=1000)] = 100
) -> Response:
    """List the robot's moves, newest first."""
    return json_response(ScaraMoveList(moves=moves.newest(plant_of(request), f"/scaras/{scara_id}", limit)))


@router.get("/scaras/{scara_id}/moves/{move_id}", Right.VIEW, response_model=ScaraMove)
async def get_scara_move(request: Request, scara_id: ScaraId, move_id: str, wait: Wait = None) -> Response:
    """Get a move, at once or when it is over."""
    waited_s = wait_s(request, wait)
    move = await moves.get(plant_of(request), f"/scaras/{scara_id}", move_id, waited_s)
    return json_response(move, headers=wait_headers(waited_s))
