"""Software stops of robots."""

from typing import Final

from gateway.core.operation import Rows
from gateway.core.origin import current
from gateway.core.rights import Right
from gateway.core.targets import Stopped
from gateway.door import stopping
from gateway.door.results import StopResult
from gateway.door.stops import SLOWLY, StopRequest
from gateway.fics.axes import RobotId, UnitNumber
from gateway.plant import Plant

ROWS: Final = Rows("robots")


@ROWS.post("/robots/{robot_id}/stop", Right.STOP, result=StopResult)
async def stop_robot(plant: Plant, robot_id: RobotId, stop: StopRequest = SLOWLY) -> Stopped:
    """Stop all axes of a robot by software: what waits is cancelled, and the stop goes out first."""
    return await stopping.stop(plant, current(), f"/robots/{robot_id}", stop.mode)


@ROWS.post("/robots/{robot_id}/units/{unit}/stop", Right.STOP, result=StopResult)
async def stop_unit(plant: Plant, robot_id: RobotId, unit: UnitNumber, stop: StopRequest = SLOWLY) -> Stopped:
    """Stop all axes of the unit's robot by software: it knows no stop of a single unit."""
    return await stopping.stop(plant, current(), f"/robots/{robot_id}/units/{unit}", stop.mode)
