"""Software stops of bodies and groups."""

from typing import Final

from gateway.core.operation import Rows
from gateway.core.origin import current
from gateway.core.rights import Right
from gateway.core.targets import Stopped
from gateway.door import stopping
from gateway.door.results import StopResult
from gateway.door.stops import SLOWLY, StopRequest
from gateway.plant import Plant
from gateway.rorze.names import BodyId, GroupId

ROWS: Final = Rows("stops")


@ROWS.post("/bodies/{body_id}/stop", Right.STOP, result=StopResult)
async def stop_body(plant: Plant, body_id: BodyId, stop: StopRequest = SLOWLY) -> Stopped:
    """Stop a body by software: what waits is cancelled, and the stop goes out at the next frame boundary."""
    return await stopping.stop(plant, current(), f"/bodies/{body_id}", stop.mode)


@ROWS.post("/groups/{group_id}/stop", Right.STOP, result=StopResult)
async def stop_group(plant: Plant, group_id: GroupId, stop: StopRequest = SLOWLY) -> Stopped:
    """Stop all members of a group by software, with one frame for all and then one for each."""
    return await stopping.stop(plant, current(), f"/groups/{group_id}", stop.mode)
