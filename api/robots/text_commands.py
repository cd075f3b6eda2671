"""Commands to robots as plain text, where the configuration allows it."""

from typing import Annotated, Any, Final

from fastapi import Request, Response
from pydantic import BaseModel, Field

from api.common.problems import DECLARED
from api.common.requests import new_router
from api.common.text_commands import TextRoute, send_text
from api.robots.names import robot_of
from gateway.core.operation import Wait
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.targets import Answer
from gateway.door.names import RobotId, UnitNumber
from gateway.door.results import StopResult
from gateway.fics.move_record import RobotMove
from protocols.fics.row import FicsCommand

router = new_router("commands", TextRoute)


class RobotRawRequest(RequestModel, json_schema_extra=example(text="VER")):
    """A command as it stands on the line, without its terminator."""

    text: Annotated[str, Field(pattern=r"^[0-9A-Z]{3}( [ -~]*)?$", max_length=250, examples=["VER"])]


class RobotRawReply(BaseModel):
    """What was answered."""

    robot_id: str
    sent: str = Field(description="The exact bytes, the terminator as \\r.")
    replies: list[str] = Field(
        description="What followed the name in each answer, as it came; none where mode 2 answers nothing."
    )


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
    def told(command: FicsCommand[Any], answer: Answer) -> RobotRawReply:
        return RobotRawReply(
            robot_id=robot_id,
            sent=robot_of(request, robot_id).line.frame_of(command),
            replies=list(answer.texts),
        )

    return await send_text(request, target, raw.text, wait, told)
