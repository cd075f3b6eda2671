"""Commands to robots as plain text, where the configuration allows it."""

from collections.abc import Mapping
from typing import Annotated, Any, Final

from pydantic import Field

from gateway.core.operation import Rows, Wait
from gateway.core.records import AnswerModel, RequestModel, example
from gateway.core.rights import Right
from gateway.core.targets import CommandReplies, Target
from gateway.door.doing import do_text
from gateway.door.results import StopResult
from gateway.fics.axes import RobotId
from gateway.fics.move_record import RobotMove
from gateway.fics.robot import Robot, Robots
from gateway.plant import Plant

ROWS: Final = Rows("commands")


class RobotRawRequest(RequestModel, json_schema_extra=example(text="VER")):
    """A command as it stands on the line, without its terminator."""

    text: Annotated[str, Field(pattern=r"^[0-9A-Z]{3}( [ -~]*)?$", max_length=250, examples=["VER"])]


class RobotRawReply(AnswerModel):
    """The bytes that were sent, and the answers to them."""

    robot_id: str
    sent: str = Field(description="The exact bytes, the terminator as \\r.")
    replies: list[str] = Field(
        description="Text behind the name in each answer, as it came; none where mode 2 answers nothing."
    )


_OF_ROBOTS: Final[Mapping[str, Any]] = {
    "leased": False,
    "result": RobotRawReply | StopResult,
    "may_begin": RobotMove,
}


@ROWS.post("/robots/{robot_id}/raw", Right.SETUP, **_OF_ROBOTS)
async def send_robot_raw(
    plant: Plant, robot: Robot, target: Target, raw: RobotRawRequest, *, wait: Wait = None, keyed: bool
) -> Any:
    """Send a command as text. A command that moves makes a move, and one that stops makes a stop."""
    command, result = await do_text(plant, target, raw.text, wait, keyed=keyed)
    if not isinstance(result, CommandReplies):
        return result
    return RobotRawReply(robot_id=robot.id, sent=robot.line.frame_of(command), replies=list(result.texts))


@ROWS.post("/robots/{robot_id}/units/{unit}/raw", Right.SETUP, **_OF_ROBOTS)
async def send_unit_raw(
    plant: Plant,
    robot_id: RobotId,
    target: Target,
    raw: RobotRawRequest,
    *,
    wait: Wait = None,
    keyed: bool,
) -> Any:
    """Send a command as text to a unit."""
    robot = plant.family(Robots).robot(robot_id)
    return await send_robot_raw(plant, robot, target, raw, wait=wait, keyed=keyed)
