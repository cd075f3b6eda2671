"""Commands to robots as plain text, where the configuration allows it."""

from functools import partial
from typing import Any, Final

from fastapi import Request, Response

from api.common.problems import DECLARED
from api.common.requests import new_router
from api.common.text_commands import TextRoute, send_text
from api.robots.names import robot_of
from gateway.core.operation import Wait
from gateway.core.rights import Right
from gateway.door.names import RobotId, UnitNumber
from gateway.door.results import StopResult
from gateway.door.text_commands import RobotRawReply, RobotRawRequest, told_by_robot
from gateway.fics.move_record import RobotMove

router = new_router("commands", TextRoute)


_ANSWERS: Final[dict[str, Any]] = {
    "response_model": RobotRawReply | StopResult,
    "responses": {**DECLARED, 202: {"model": RobotMove, "description": "The command has started a move."}},
}


@router.post("/robots/{robot_id}/raw", Right.SETUP, **_ANSWERS)
async def send_robot_raw(
    request: Request, robot_id: RobotId, raw: RobotRawRequest, wait: Wait = None
) -> Response:
    """Send a command as text. A command that moves makes a move, and one that stops makes a stop."""
    return await _send(request, robot_id, f"/robots/{robot_id}", raw, wait)


@router.post("/robots/{robot_id}/units/{unit}/raw", Right.SETUP, **_ANSWERS)
async def send_unit_raw(
    request: Request, robot_id: RobotId, unit: UnitNumber, raw: RobotRawRequest, wait: Wait = None
) -> Response:
    """Send a command as text to a unit."""
    return await _send(request, robot_id, f"/robots/{robot_id}/units/{unit}", raw, wait)


async def _send(
    request: Request, robot_id: str, target: str, raw: RobotRawRequest, wait: float | None
) -> Response:
    told = partial(told_by_robot, robot_of(request, robot_id))
    return await send_text(request, target, raw.text, wait, told)
