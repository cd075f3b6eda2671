"""Moves and stops of families for which no routes are written by hand."""

from typing import Any

from fastapi import APIRouter, Request, Response
from pydantic_core import to_json

from api.common.parameters import Endpoint, names_in, taking
from api.common.problems import DECLARED
from api.common.requests import Wait, json_response, new_router, plant_of, wait_headers, wait_s
from api.common.results import StopResult
from api.stops import StopBody, perform_stop
from gateway.core.family import Place
from gateway.operations import moves

NEWEST = 100


def resource_router(place: Place) -> APIRouter:
    """Make the routes by which moves are found again, and what stands at a place is stopped."""
    what = place.path.split("/")[1]
    router = new_router(what)
    add, names = router.add_api_route, names_in(place.path, {})
    list_all, get_one, stop_it = _endpoints(place)
    described: dict[str, Any] = {"responses": DECLARED}
    add(f"{place.path}/moves", taking(list_all, names), name=f"list_moves_of_{what}", **described)
    add(
        f"{place.path}/moves/{{move_id}}",
        taking(get_one, {**names, "move_id": str, "wait": Wait}),
        name=f"get_move_of_{what}",
        response_model=place.move,
        **described,
    )
    add(
        f"{place.path}/stop",
        taking(stop_it, {**names, "stop": StopBody}),
        methods=["POST"],
        name=f"stop_one_of_{what}",
        response_model=StopResult,
        **described,
    )
    return router


def _endpoints(place: Place) -> tuple[Endpoint, Endpoint, Endpoint]:
    async def list_moves(request: Request, **names: object) -> Response:
        """List the newest moves, newest first."""
        newest = moves.newest(plant_of(request), place.path.format(**names), NEWEST)
        return Response(to_json({"moves": newest}), media_type="application/json")

    async def get_move(request: Request, move_id: str, wait: float | None, **names: object) -> Response:
        """Get a move, at once or when it is over."""
        waited_s, target = wait_s(request, wait), place.path.format(**names)
        move = await moves.get(plant_of(request), target, move_id, waited_s)
        return json_response(move, headers=wait_headers(waited_s))

    async def stop(request: Request, stop: StopBody, **names: object) -> Response:
        """Stop it by software: what waits is cancelled, and the stop goes out first."""
        return await perform_stop(request, place.path.format(**names), stop)

    return list_moves, get_move, stop
