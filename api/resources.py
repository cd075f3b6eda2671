"""Moves and stops of families for which no routes are written by hand."""

from collections.abc import Mapping
from typing import Annotated, Any

from fastapi import Body, Request, Response

from api.common.parameters import Endpoint, names_of, taking
from api.common.requests import content_response, json_response, new_router, plant_of, wait_headers, wait_s
from api.common.results import render
from api.common.routes import Router
from gateway.core.family import Place
from gateway.core.operation import Wait
from gateway.core.origin import current
from gateway.core.rights import Right
from gateway.core.targets import Target
from gateway.door import moving, stopping
from gateway.door.caller import require
from gateway.door.results import StopResult
from gateway.door.stops import StopRequest

NEWEST = 100


def resource_router(place: Place) -> Router:
    """Make the routes by which moves are found again, and what stands at a place is stopped."""
    what = place.path.split("/")[1]
    router = new_router(what)
    names, path = names_of(place.path, {}), f"{place.path}/moves"
    list_all, get_one, stop_it = _endpoints(place)
    get_it = taking(get_one, {**names, "move_id": str, "wait": Wait})
    stop = taking(stop_it, {**names, "stop": Annotated[StopRequest, Body(default_factory=StopRequest)]})
    one: dict[str, Any] = {"name": f"get_move_of_{what}", "response_model": place.move}
    router.add("GET", path, Right.VIEW, taking(list_all, names), name=f"list_moves_of_{what}")
    router.add("GET", f"{path}/{{move_id}}", Right.VIEW, get_it, **one)
    stopped: dict[str, Any] = {"name": f"stop_one_of_{what}", "response_model": StopResult}
    router.add("POST", f"{place.path}/stop", Right.STOP, stop, **stopped)
    return router


def _endpoints(place: Place) -> tuple[Endpoint, Endpoint, Endpoint]:
    async def list_moves(request: Request, **names: object) -> Response:
        """List the newest moves, newest first."""
        newest = moving.newest(_found(request, place, names), NEWEST)
        return content_response({"moves": newest})

    async def get_move(
        request: Request, move_id: str, wait: float | None = None, **names: object
    ) -> Response:
        """Get a move, at once or when it is over."""
        waited_s = wait_s(request, wait)
        move = await moving.get(_found(request, place, names), move_id, waited_s)
        return json_response(move, headers=wait_headers(waited_s))

    async def stop(request: Request, stop: StopRequest, **names: object) -> Response:
        """Stop it by software: what waits is cancelled, and the stop goes out first."""
        target = place.path.format(**names)
        return render(request, await stopping.stop(plant_of(request), current(), target, stop.mode))

    return list_moves, get_move, stop


def _found(request: Request, place: Place, names: Mapping[str, object]) -> Target:
    """Find what a request is about, for a caller who may see it."""
    plant, path = plant_of(request), place.path.format(**names)
    require(plant, Right.VIEW, path)
    return plant.target(path)
