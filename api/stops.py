"""Software stops over HTTP: ahead of everything, and never in need of more than a body's address."""

from typing import Annotated

from fastapi import Body, Request, Response
from pydantic import Field

from api.common.requests import new_router, origin, plant_of
from api.common.results import StopResult, render
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.stops import StopMode
from gateway.door.names import BodyId, GroupId
from gateway.operations import stops

router = new_router("stops")


class StopRequest(RequestModel, json_schema_extra=example(mode="decelerate")):
    """How to stop."""

    mode: StopMode = Field(
        default="decelerate",
        description="`decelerate` is command 5SS, `immediate` is 5IS (RC-420 manual 14); "
        "for robots ASS and AES (C-HOST manual 2-7, 2-8).",
    )


StopBody = Annotated[StopRequest, Body(default_factory=StopRequest)]


@router.post("/stop", Right.STOP, response_model=StopResult)
async def stop_all(request: Request, stop: StopBody) -> Response:
    """Stop all bodies and robots of all lines by software. It does not replace a hardware stop."""
    return render(request, await stops.stop_all(plant_of(request), origin(), stop.mode))


@router.post("/bodies/{body_id}/stop", Right.STOP, response_model=StopResult)
async def stop_body(request: Request, body_id: BodyId, stop: StopBody) -> Response:
    """Stop a body by software: what waits is cancelled, and the stop goes out at the next frame boundary."""
    return await perform_stop(request, f"/bodies/{body_id}", stop)


@router.post("/groups/{group_id}/stop", Right.STOP, response_model=StopResult)
async def stop_group(request: Request, group_id: GroupId, stop: StopBody) -> Response:
    """Stop all members of a group by software, with one frame for all and then one for each."""
    return await perform_stop(request, f"/groups/{group_id}", stop)


async def perform_stop(request: Request, target: str, stop: StopRequest) -> Response:
    """Stop what stands at a path."""
    return render(request, await stops.stop(plant_of(request), origin(), target, stop.mode))
