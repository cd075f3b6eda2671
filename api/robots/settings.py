"""A unit's settings over HTTP: all that can be read back, by the names of the axes."""

from fastapi import Request, Response

from api.common.etags import IF_MATCH, expected_by, tagged
from api.common.requests import json_response, new_router, origin, plant_of
from api.robots.names import RobotId, UnitNumber
from gateway.core.rights import Right
from gateway.fics.settings import SettingsChange, UnitSettings
from gateway.operations import settings

router = new_router("robot settings")


@router.get("/robots/{robot_id}/units/{unit}/settings", Right.VIEW, response_model=UnitSettings)
async def get_settings(request: Request, robot_id: RobotId, unit: UnitNumber) -> Response:
    """Ask the robot for all settings of a unit, one by one; refused while it moves."""
    return tagged(await settings.read(plant_of(request), origin(), robot_id, unit))


@router.patch(
    "/robots/{robot_id}/units/{unit}/settings", Right.SETUP, response_model=UnitSettings, **IF_MATCH
)
async def change_settings(
    request: Request, robot_id: RobotId, unit: UnitNumber, change: SettingsChange
) -> Response:
    """Change settings of a unit and read them back; refused while it moves.

    All are checked before the first is sent. They are sent one by one, each read back before the next; where
    the robot refuses one, or tells another value afterwards, the problem tells which were changed before it.
    With `If-Match` all settings are read before, and nothing is sent where they are otherwise than they were.
    """
    plant, expects = plant_of(request), expected_by(request, change)
    return json_response(await settings.change(plant, origin(), robot_id, unit, change, expects))
