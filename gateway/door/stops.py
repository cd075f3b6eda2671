"""Software stops: ahead of everything, and never in need of more than an address."""

from typing import Final

from pydantic import Field

from gateway.core.operation import Rows
from gateway.core.origin import current
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.stops import StopMode
from gateway.core.targets import Stopped
from gateway.door import stopping
from gateway.door.names import BodyId, GroupId, RobotId, ScaraId, UnitNumber
from gateway.door.results import StopResult
from gateway.plant import Plant

ROWS: Final = Rows("stops")
OF_ROBOTS: Final = Rows("robots")
OF_SCARAS: Final = Rows("scaras")


class StopRequest(RequestModel, json_schema_extra=example(mode="decelerate")):
    """How to stop."""

    mode: StopMode = Field(
        default="decelerate",
        description="`decelerate` is command 5SS, `immediate` is 5IS (RC-420 manual 14); "
        "for robots ASS and AES (C-HOST manual 2-7, 2-8).",
    )


SLOWLY: Final = StopRequest()


@ROWS.post("/stop", Right.STOP, result=StopResult)
async def stop_all(plant: Plant, stop: StopRequest = SLOWLY) -> Stopped:
    """Stop all bodies and robots of all lines by software. It does not replace a hardware stop."""
    return await stopping.stop_all(plant, current(), stop.mode)


@ROWS.post("/bodies/{body_id}/stop", Right.STOP, result=StopResult)
async def stop_body(plant: Plant, body_id: BodyId, stop: StopRequest = SLOWLY) -> Stopped:
    """Stop a body by software: what waits is cancelled, and the stop goes out at the next frame boundary."""
    return await stopping.stop(plant, current(), f"/bodies/{body_id}", stop.mode)


@ROWS.post("/groups/{group_id}/stop", Right.STOP, result=StopResult)
async def stop_group(plant: Plant, group_id: GroupId, stop: StopRequest = SLOWLY) -> Stopped:
    """Stop all members of a group by software, with one frame for all and then one for each."""
    return await stopping.stop(plant, current(), f"/groups/{group_id}", stop.mode)


@OF_ROBOTS.post("/robots/{robot_id}/stop", Right.STOP, result=StopResult)
async def stop_robot(plant: Plant, robot_id: RobotId, stop: StopRequest = SLOWLY) -> Stopped:
    """Stop all axes of a robot by software: what waits is cancelled, and the stop goes out first."""
    return await stopping.stop(plant, current(), f"/robots/{robot_id}", stop.mode)


@OF_ROBOTS.post("/robots/{robot_id}/units/{unit}/stop", Right.STOP, result=StopResult)
async def stop_unit(plant: Plant, robot_id: RobotId, unit: UnitNumber, stop: StopRequest = SLOWLY) -> Stopped:
    """Stop all axes of the unit's robot by software: it knows no stop of a single unit."""
    return await stopping.stop(plant, current(), f"/robots/{robot_id}/units/{unit}", stop.mode)


@OF_SCARAS.post("/scaras/{scara_id}/stop", Right.STOP, result=StopResult)
async def stop_scara(plant: Plant, scara_id: ScaraId, stop: StopRequest = SLOWLY) -> Stopped:
    """Stop all axes of a robot by software, with one frame for all and then one for each."""
    return await stopping.stop(plant, current(), f"/scaras/{scara_id}", stop.mode)
