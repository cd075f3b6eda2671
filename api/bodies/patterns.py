"""Acceleration patterns of a body over HTTP, with their speed changes and the curves that come of them."""

from typing import Annotated, Literal

from fastapi import Path, Query, Request, Response
from pydantic import BaseModel, Field

from api.bodies.speed_sets import First, Flash, Last
from api.common.etags import IF_MATCH, expected_by, tagged
from api.common.requests import BodyId, json_response, new_router, origin, plant_of
from gateway.core.rights import Right
from gateway.operations import body_settings
from gateway.rorze.curves import CurveDraft, SpeedCurve
from gateway.rorze.patterns import ChangedPattern, Pattern, PatternChange, PatternValues
from gateway.rorze.speed_sets import STANDARD

router = new_router("body settings")

PatternNumber = Annotated[
    int, Path(ge=0, le=STANDARD, description="0-29, or 30: the standard pattern.", examples=[12])
]
Distance = Annotated[float, Query(gt=0, lt=1e9, allow_inf_nan=False, description="How far the move goes.")]
CurveUnit = Annotated[
    Literal["pulse", "mm", "um", "deg", "mdeg"], Query(description="Of the distance; pulses are whole.")
]
CurveSpeed = Annotated[
    Literal["high", "low"], Query(description="`low` runs at the start speed, without ramps.")
]
Points = Annotated[int, Query(ge=2, le=2_000, description="How many moments, evenly spread.")]


class PatternList(BaseModel):
    """Acceleration patterns of a body."""

    body_id: str
    patterns: list[Pattern] = Field(description="In the order of their numbers.")


@router.get("/bodies/{body_id}/patterns", Right.VIEW, response_model=PatternList)
async def list_patterns(
    request: Request, body_id: BodyId, first: First = 0, last: Last = STANDARD
) -> Response:
    """Ask a body for its acceleration patterns: one frame for each, and sixteen more for one that is set."""
    plant = plant_of(request)
    found = await body_settings.read_patterns(plant, origin(), body_id, first, last)
    return json_response(PatternList(body_id=found[0].body_id, patterns=found))


@router.get("/bodies/{body_id}/patterns/{n}", Right.VIEW, response_model=Pattern)
async def get_pattern(request: Request, body_id: BodyId, n: PatternNumber) -> Response:
    """Ask a body for an acceleration pattern (SPD) with its speed changes (SED)."""
    return tagged(await body_settings.read_pattern(plant_of(request), origin(), body_id, n))


@router.put("/bodies/{body_id}/patterns/{n}", Right.SETUP, response_model=ChangedPattern, **IF_MATCH)
async def set_pattern(
    request: Request, body_id: BodyId, n: PatternNumber, values: PatternValues, *, flash: Flash = False
) -> Response:
    """Set what differs of a pattern and its speed changes, and read it back; refused while the motor moves.

    Where a change shall go, all are cleared (SES) and those that stay are set again.
    """
    return await _change(request, body_id, n, values, flash=flash)


@router.patch("/bodies/{body_id}/patterns/{n}", Right.SETUP, response_model=ChangedPattern, **IF_MATCH)
async def change_pattern(
    request: Request, body_id: BodyId, n: PatternNumber, change: PatternChange, *, flash: Flash = False
) -> Response:
    """Set what differs of what is named, and read it back; refused while the motor moves."""
    return await _change(request, body_id, n, change, flash=flash)


@router.get("/bodies/{body_id}/patterns/{n}/curve", Right.VIEW, response_model=SpeedCurve)
async def get_curve(
    request: Request,
    body_id: BodyId,
    n: PatternNumber,
    distance: Distance,
    unit: CurveUnit = "pulse",
    speed: CurveSpeed = "high",
    points: Points = 200,
) -> Response:
    """Work out how a move with this pattern would go, with the settings of now; nothing moves."""
    plant, caller = plant_of(request), origin()
    return json_response(await body_settings.curve(plant, caller, body_id, n, distance, unit, speed, points))


@router.post("/bodies/{body_id}/patterns/{n}/curve", Right.VIEW, response_model=SpeedCurve)
async def draft_curve(request: Request, body_id: BodyId, n: PatternNumber, draft: CurveDraft) -> Response:
    """Work out how a move would go if the pattern were this one; nothing is set, and nothing moves."""
    plant, caller = plant_of(request), origin()
    return json_response(await body_settings.draft_curve(plant, caller, body_id, n, draft))


async def _change(
    request: Request, body_id: str, n: int, wanted: PatternValues | PatternChange, *, flash: bool
) -> Response:
    plant, expects = plant_of(request), expected_by(request, wanted)
    caller = origin()
    return tagged(await body_settings.change_pattern(plant, caller, body_id, n, wanted, expects, flash=flash))
