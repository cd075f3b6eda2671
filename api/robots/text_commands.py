"""Commands to robots as plain text, where the configuration allows it: the same scheduler, the same rules."""

from typing import Annotated, Any, cast

from fastapi import Request, Response
from pydantic import BaseModel, Field

from api.bodies.text_commands import TextRoute
from api.common.idempotency import require_no_key
from api.common.problems import DECLARED
from api.common.requests import Wait, json_response, new_router, origin, plant_of, wait_s
from api.common.results import StopResult, render
from api.robots.paths import RobotId, UnitNumber, robot_of
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.targets import Answer
from gateway.fics.move_record import RobotMove
from gateway.operations.commands import do, read_text
from protocols.fics.row import FicsCommand
from protocols.table import Effect

router = new_router("commands", TextRoute)


class RobotRawRequest(RequestModel, json_schema_extra=example(text="APS")):
    """A command as it stands on the line, without its terminator."""

    text: Annotated[str, Field(pattern=r"^[0-9A-Z]{3}( [ -~]*)?$", max_length=250, examples=["APS"])]


class RobotRawReply(BaseModel):
    """What was answered."""

    robot_id: str
    sent: str = Field(description="The exact bytes, the terminator as \\r.")
    replies: list[str] = Field(description="What followed the name in each answer, as it was read.")


RESPONSES: dict[int | str, dict[str, Any]] = {
    **DECLARED,
    202: {"model": RobotMove, "description": "The command has started a move."},
}


@router.post(
    "/robots/{robot_id}/raw",
    Right.SETUP,
    response_model=RobotRawReply | StopResult,
    responses=RESPONSES,
)
async def send_robot_raw(
    request: Request, robot_id: RobotId, raw: RobotRawRequest, wait: Wait = None
) -> Response:
    """Send a command as text. A command that moves makes a move, and one that stops makes a stop."""
    return await _send(request, robot_id, f"/robots/{robot_id}", raw, wait)


@router.post(
    "/robots/{robot_id}/units/{unit}/raw",
    Right.SETUP,
    response_model=RobotRawReply | StopResult,
    responses=RESPONSES,
)
async def send_unit_raw(
    request: Request, robot_id: RobotId, unit: UnitNumber, raw: RobotRawRequest, wait: Wait = None
) -> Response:
    """Send a command as text to a unit."""
    return await _send(request, robot_id, f"/robots/{robot_id}/units/{unit}", raw, wait)


async def _send(
    request: Request, robot_id: str, target: str, raw: RobotRawRequest, wait: float | None
) -> Response:
    plant = plant_of(request)
    command = read_text(plant, target, raw.text)
    if command.effect is not Effect.STOP:
        require_no_key(request)
    waited_s = wait_s(request, wait)
    result = await do(plant, origin(), target, command, waited_s)
    if not isinstance(result, Answer):
        return render(request, result, waited_s)
    return json_response(
        RobotRawReply(
            robot_id=robot_id,
            sent=robot_of(request, robot_id).line.frame_of(cast("FicsCommand[Any]", command)),
            replies=[reply.written() for reply in result.replies],
        )
    )
