"""Backups over HTTP as text alone, read while the request waits."""

from typing import Final

from fastapi import Request, Response

from api.common.problems import DECLARED
from api.common.requests import new_router, plant_of
from gateway.core.rights import Right
from gateway.door import backups
from gateway.door.backups import Bodies, Reading
from gateway.door.caller import require
from gateway.door.names import BodyId, LineId, RobotId

router = new_router("backups")

TEXT: Final = "text/plain"
BACKUP: Final = {
    **DECLARED,
    200: {"content": {TEXT: {"schema": {"type": "string"}}}, "description": "The backup."},
}


@router.get("/bodies/{body_id}/backup", Right.VIEW, response_class=Response, responses=BACKUP)
async def get_body_backup(request: Request, body_id: BodyId) -> Response:
    """Read all that a body keeps: settings, speeds, patterns, positions, memories, user program.

    It takes two minutes at 9600 baud; others are served meanwhile. `POST .../backups` answers at once.
    """
    return await _text(request, backups.of_body(plant_of(request), body_id))


@router.get("/lines/{line_id}/backup", Right.VIEW, response_class=Response, responses=BACKUP)
async def get_line_backup(request: Request, line_id: LineId, bodies: Bodies = None) -> Response:
    """Read all that the bodies of a line keep, as one text. It takes two minutes a body at 9600 baud.

    All of them have to answer; `bodies` leaves out who does not. `POST .../backups` answers at once.
    """
    return await _text(request, _of_line(request, line_id, bodies))


@router.get("/robots/{robot_id}/backup", Right.VIEW, response_class=Response, responses=BACKUP)
async def get_robot_backup(request: Request, robot_id: RobotId) -> Response:
    """Read what a robot tells of what it keeps: variables, and of each unit settings and positions."""
    return await _text(request, backups.of_robot(plant_of(request), robot_id))


async def _text(request: Request, reading: Reading) -> Response:
    plant = plant_of(request)
    require(plant, Right.VIEW, reading.target)
    return Response(await backups.text(reading), media_type=TEXT)


def _of_line(request: Request, line_id: str, bodies: str | None) -> Reading:
    return backups.of_line(plant_of(request), line_id, backups.chosen_of(bodies))
