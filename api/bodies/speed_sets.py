"""Speed parameter sets of a body over HTTP."""

from typing import Annotated

from fastapi import Path, Query, Request, Response
from pydantic import BaseModel, Field

from api.common.etags import IF_MATCH, expected_by, tagged
from api.common.requests import BodyId, json_response, new_router, origin, plant_of
from gateway.core.rights import Right
from gateway.operations import body_settings
from gateway.rorze.speed_sets import STANDARD, ChangedSpeedSet, SpeedSet, SpeedSetChange, SpeedSetValues

router = new_router("body settings")

SetNumber = Annotated[
    int, Path(ge=0, le=STANDARD, description="0-29, or 30: the standard set.", examples=[12])
]
First = Annotated[int, Query(ge=0, le=STANDARD, description="The first of the list.")]
Last = Annotated[int, Query(ge=0, le=STANDARD, description="The last of the list.")]
Flash = Annotated[bool, Query(description="Write all settings of the body to flash memory afterwards (FIS).")]


class SpeedSetList(BaseModel):
    """Speed parameter sets of a body."""

    body_id: str
    speed_sets: list[SpeedSet] = Field(description="In the order of their numbers.")


@router.get("/bodies/{body_id}/speed-sets", Right.VIEW, response_model=SpeedSetList)
async def list_speed_sets(
    request: Request, body_id: BodyId, first: First = 0, last: Last = STANDARD
) -> Response:
    """Ask a body for its speed parameter sets, five frames for each."""
    plant = plant_of(request)
    found = await body_settings.read_speed_sets(plant, origin(), body_id, first, last)
    return json_response(SpeedSetList(body_id=found[0].body_id, speed_sets=found))


@router.get("/bodies/{body_id}/speed-sets/{n}", Right.VIEW, response_model=SpeedSet)
async def get_speed_set(request: Request, body_id: BodyId, n: SetNumber) -> Response:
    """Ask a body for a speed parameter set (OLD, OHD, OSD, OAD, OBD)."""
    return tagged(await body_settings.read_speed_set(plant_of(request), origin(), body_id, n))


@router.put("/bodies/{body_id}/speed-sets/{n}", Right.SETUP, response_model=ChangedSpeedSet, **IF_MATCH)
async def set_speed_set(
    request: Request, body_id: BodyId, n: SetNumber, values: SpeedSetValues, *, flash: Flash = False
) -> Response:
    """Set the parameters of a set that differ, and read each back; refused while the motor moves."""
    return await _change(request, body_id, n, values, flash=flash)


@router.patch("/bodies/{body_id}/speed-sets/{n}", Right.SETUP, response_model=ChangedSpeedSet, **IF_MATCH)
async def change_speed_set(
    request: Request, body_id: BodyId, n: SetNumber, change: SpeedSetChange, *, flash: Flash = False
) -> Response:
    """Set those of the named parameters that differ, and read each back; refused while the motor moves."""
    return await _change(request, body_id, n, change, flash=flash)


async def _change(
    request: Request, body_id: str, n: int, wanted: SpeedSetValues | SpeedSetChange, *, flash: bool
) -> Response:
    plant, expects = plant_of(request), expected_by(request, wanted)
    caller = origin()
    return tagged(
        await body_settings.change_speed_set(plant, caller, body_id, n, wanted, expects, flash=flash)
    )
