"""Where bodies and units of robots were seen during their moves, over HTTP: as JSON and as CSV."""

from typing import Any, Final

from fastapi import Request, Response

from api.common.csv_tables import ANSWER, csv_response
from api.common.problems import DECLARED
from api.common.requests import new_router, plant_of
from gateway.core.rights import Right
from gateway.core.targets import Target
from gateway.door import moving
from gateway.door.caller import require
from gateway.door.names import BodyId, RobotId, UnitNumber
from gateway.fics.samples import RobotSamples
from gateway.rorze.samples import BodySamples

router = new_router("samples")

OF_BODY: Final = "/bodies/{body_id}/moves/{move_id}/samples"
OF_UNIT: Final = "/robots/{robot_id}/units/{unit}/moves/{move_id}/samples"
TABLE: Final[dict[int | str, dict[str, Any]]] = {**DECLARED, 200: ANSWER}


@router.get(f"{OF_BODY}.csv", Right.VIEW, response_class=Response, responses=TABLE)
async def download_samples(request: Request, body_id: BodyId, move_id: str) -> Response:
    """Get the same as CSV: time, time_s, pulses, the planned pulses, and the value in the body's unit."""
    told: BodySamples = await _samples(request, f"/bodies/{body_id}", move_id)
    scaled = [f"value {told.unit}"] if told.unit else []
    rows = (
        [it.time.isoformat(), it.time_s, it.pulses, it.planned_pulses, *([it.value] if scaled else [])]
        for it in told.samples
    )
    return csv_response(["time", "time_s", "pulses", "planned_pulses", *scaled], rows)


@router.get(f"{OF_UNIT}.csv", Right.VIEW, response_class=Response, responses=TABLE)
async def download_robot_samples(
    request: Request, robot_id: RobotId, unit: UnitNumber, move_id: str
) -> Response:
    """Get the same as CSV: time, time_s, a column for each axis with its unit, and one for its plan."""
    told: RobotSamples = await _samples(request, f"/robots/{robot_id}/units/{unit}", move_id)
    columns = [f"{axis} {unit}" for axis, unit in told.units.items()]
    header = ["time", "time_s", *columns, *(f"planned {column}" for column in columns)]
    rows = (
        [
            *(it.time.isoformat(), it.time_s),
            *(it.axes.get(axis) for axis in told.units),
            *((it.planned or {}).get(axis) for axis in told.units),
        ]
        for it in told.samples
    )
    return csv_response(header, rows)


async def _samples(request: Request, target: str, move_id: str) -> Any:
    return await moving.samples(_found(request, target), move_id)


def _found(request: Request, path: str) -> Target:
    plant = plant_of(request)
    require(plant, Right.VIEW, path)
    return plant.target(path)
