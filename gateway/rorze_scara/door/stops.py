"""The software stop of a SCARA robot."""

from typing import Final

from gateway.core.operation import Rows
from gateway.core.origin import current
from gateway.core.rights import Right
from gateway.core.targets import Stopped
from gateway.door import stopping
from gateway.door.results import StopResult
from gateway.door.stops import SLOWLY, StopRequest
from gateway.plant import Plant
from gateway.rorze_scara.extension import ScaraId

ROWS: Final = Rows("scaras")


@ROWS.post("/scaras/{scara_id}/stop", Right.STOP, result=StopResult)
async def stop_scara(plant: Plant, scara_id: ScaraId, stop: StopRequest = SLOWLY) -> Stopped:
    """Stop all axes of a robot by software, with one frame for all and then one for each."""
    return await stopping.stop(plant, current(), f"/scaras/{scara_id}", stop.mode)
