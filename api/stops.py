"""Software stops over HTTP: ahead of everything, and never in need of more than a body's address."""

from collections.abc import Sequence
from typing import Annotated

from fastapi import Body, Request, Response
from pydantic import BaseModel, Field

from api.common.requests import BodyId, GroupId, RequestModel, example, json_response, new_router, plant_of
from gateway.core.rights import Right
from gateway.core.stops import StopMode
from gateway.fics.robot import Robot
from gateway.fics.stops import RobotStopReport
from gateway.rorze.bodies import Body as PlantBody
from gateway.rorze.stops import StopReport

router = new_router("stops")


class StopRequest(RequestModel, json_schema_extra=example(mode="decelerate")):
    """How to stop."""

    mode: StopMode = Field(
        default="decelerate",
        description="`decelerate` is command 5SS, `immediate` is 5IS (RC-420 manual 14); "
        "for robots ASS and AES (C-HOST manual 2-7, 2-8).",
    )


class StopResult(BaseModel):
    """How far the stop has come, after two seconds at most."""

    confirmed: bool = Field(
        description="Whether every controller reports standstill. If not, use the hardware stop."
    )
    bodies: list[StopReport]
    robots: list[RobotStopReport]


StopBody = Annotated[StopRequest, Body(default_factory=StopRequest)]


@router.post("/stop", Right.STOP, response_model=StopResult)
async def stop_all(request: Request, stop: StopBody) -> Response:
    """Stop all bodies and robots of all lines by software. It does not replace a hardware stop."""
    plant = plant_of(request)
    return await perform_stop(request, plant.bodies(), stop.mode, plant.robots())


@router.post("/bodies/{body_id}/stop", Right.STOP, response_model=StopResult)
async def stop_body(request: Request, body_id: BodyId, stop: StopBody) -> Response:
    """Stop a body by software: what waits is cancelled, and the stop goes out at the next frame boundary."""
    return await perform_stop(request, [plant_of(request).body(body_id)], stop.mode)


@router.post("/groups/{group_id}/stop", Right.STOP, response_model=StopResult)
async def stop_group(request: Request, group_id: GroupId, stop: StopBody) -> Response:
    """Stop all members of a group by software, with one frame for all and then one for each."""
    group = plant_of(request).group(group_id)
    return await perform_stop(request, group.members, stop.mode)


async def perform_stop(
    request: Request, bodies: list[PlantBody], mode: StopMode, robots: Sequence[Robot] = ()
) -> Response:
    """Stop bodies and robots; the frames are queued before anything is awaited."""
    of_robots = [robot.stop(mode) for robot in robots]
    reports = await plant_of(request).stops.stop(bodies, mode)
    robot_reports = [await report for report in of_robots]
    states = [report.state for report in reports] + [report.state for report in robot_reports]
    confirmed = all(state == "confirmed" for state in states)
    return json_response(StopResult(confirmed=confirmed, bodies=reports, robots=robot_reports))
