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
from gateway.door.results import StopResult
from gateway.families import FAMILIES
from gateway.plant import Plant

ROWS: Final = Rows("stops")


class StopRequest(RequestModel, json_schema_extra=example(mode="decelerate")):
    """The way to stop."""

    mode: StopMode = Field(
        default="decelerate",
        description="; ".join(filter(None, (family.told_of_stops for family in FAMILIES.values()))) + ".",
    )


SLOWLY: Final = StopRequest()


@ROWS.post("/stop", Right.STOP, result=StopResult)
async def stop_all(plant: Plant, stop: StopRequest = SLOWLY) -> Stopped:
    """Stop all bodies and robots of all lines by software. It does not replace a hardware stop."""
    return await stopping.stop_all(plant, current(), stop.mode)
