"""The interpolation paths that SCARA robots hold, over HTTP."""

from collections.abc import Mapping
from typing import Literal

from fastapi import Request, Response
from pydantic import BaseModel, Field

from api.common.requests import json_response, new_router, origin, plant_of
from api.scaras.names import PathNumber, ScaraId
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.operations import scaras
from gateway.rorze.scaras.record import Micrometres
from gateway.rorze.scaras.requests import ViaPoint
from protocols.rorze.interpolation import MOST_POINTS, PathPoint

router = new_router("scara paths")


class PathDefinition(
    RequestModel,
    json_schema_extra=example(
        points=[
            {
                "x": {"value": 255, "unit": "mm"},
                "y": {"value": 300, "unit": "mm"},
                "radius": {"value": 120, "unit": "mm"},
            },
            {"x": {"value": 255, "unit": "mm"}, "y": {"value": 450, "unit": "mm"}},
        ]
    ),
):
    """A whole path; without points it is cleared."""

    points: list[ViaPoint] = Field(max_length=MOST_POINTS, description="In their order; the last is the end.")


class StoredPoint(BaseModel):
    """A point of a path as the controllers hold it."""

    x: Micrometres | None
    y: Micrometres | None
    radius: Micrometres | None
    place: Literal["center"] | None


class StoredPath(BaseModel):
    """A path as the controllers hold it."""

    scara_id: str
    path: int
    points: list[StoredPoint] = Field(description="In their order; empty where the path is.")


@router.get("/scaras/{scara_id}/paths/{path}", Right.VIEW, response_model=StoredPath)
async def get_scara_path(request: Request, scara_id: ScaraId, path: PathNumber) -> Response:
    """Read a path from all controllers (HDD); 409 where they hold different ones."""
    points = await scaras.read_path(plant_of(request), origin(), scara_id, path)
    return json_response(_stored(scara_id, path, points))


@router.put("/scaras/{scara_id}/paths/{path}", Right.SETUP, response_model=StoredPath)
async def write_scara_path(
    request: Request, scara_id: ScaraId, path: PathNumber, wanted: PathDefinition
) -> Response:
    """Store a path in all controllers, undivided (HDS), in RAM; read it back."""
    points = [point.point() for point in wanted.points]
    stored = await scaras.write_path(plant_of(request), origin(), scara_id, path, points)
    return json_response(_stored(scara_id, path, stored))


def _stored(scara_id: str, path: int, points: Mapping[int, PathPoint]) -> StoredPath:
    return StoredPath(scara_id=scara_id.lower(), path=path, points=[_point(it) for it in points.values()])


def _point(point: PathPoint) -> StoredPoint:
    x, y, radius = (None if it is None else Micrometres(value=it) for it in (point.x, point.y, point.radius))
    return StoredPoint(x=x, y=y, radius=radius, place=point.place)
