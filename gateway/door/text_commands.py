"""Commands as plain text, where the configuration allows it: the same scheduler, the same rules."""

from typing import Annotated, Any, Final

from pydantic import BaseModel, Field

from gateway.core.operation import Rows, Wait
from gateway.core.origin import current
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.targets import Answer, Target
from gateway.core.times import age_ms_of
from gateway.door.doing import do, read_text
from gateway.door.names import RobotId
from gateway.door.results import StopResult
from gateway.fics.family import Fics
from gateway.fics.robot import Robot
from gateway.plant import Plant
from gateway.rorze.bodies import Body

ROWS: Final = Rows("commands")
MAY_STOP: Final = "only its text tells whether it is a stop, which takes no Idempotency-Key"


class RawRequest(RequestModel, json_schema_extra=example(text="6PD")):
    """A command as it stands on the line, without introducer, body number and CR."""

    text: Annotated[str, Field(pattern=r"^[0-9A-Z*+/-]{3}[ -%'-~]*$", max_length=58, examples=["6PD"])]


class RawReply(BaseModel):
    """What was answered."""

    body_id: str
    sent: str = Field(description="The exact bytes, CR as \\r.")
    reply: str = Field(description="What followed the code in the reply, as it came.")
    age_ms: float


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


@ROWS.post("/bodies/{body_id}/raw", Right.SETUP, leased=False, result=RawReply | StopResult, by_hand=MAY_STOP)
async def send_raw(plant: Plant, body: Body, target: Target, raw: RawRequest, *, wait: Wait = None) -> Any:
    """Send a command as text. A command that moves makes a move, and one that stops makes a stop."""
    command = read_text(plant, target.path, raw.text)
    result = await do(plant, current(), target.path, command, wait or 0.0)
    return told_by_body(body, command, result) if isinstance(result, Answer) else result


@ROWS.post(
    "/robots/{robot_id}/raw", Right.SETUP, leased=False, result=RobotRawReply | StopResult, by_hand=MAY_STOP
)
async def send_robot_raw(
    plant: Plant, robot: Robot, target: Target, raw: RobotRawRequest, *, wait: Wait = None
) -> Any:
    """Send a command as text. A command that moves makes a move, and one that stops makes a stop."""
    return await _send(plant, robot, target, raw, wait)


@ROWS.post(
    "/robots/{robot_id}/units/{unit}/raw",
    Right.SETUP,
    leased=False,
    result=RobotRawReply | StopResult,
    by_hand=MAY_STOP,
)
async def send_unit_raw(
    plant: Plant, robot_id: RobotId, target: Target, raw: RobotRawRequest, *, wait: Wait = None
) -> Any:
    """Send a command as text to a unit."""
    return await _send(plant, plant.family(Fics).robot(robot_id), target, raw, wait)


async def _send(plant: Plant, robot: Robot, target: Target, raw: RobotRawRequest, wait: float | None) -> Any:
    command = read_text(plant, target.path, raw.text)
    result = await do(plant, current(), target.path, command, wait or 0.0)
    return told_by_robot(robot, command, result) if isinstance(result, Answer) else result


def told_by_body(body: Body, command: Any, answer: Answer) -> RawReply:
    """What a body answered to a text."""
    return RawReply(
        body_id=body.address,
        sent=body.line.frame_of(body.number, command),
        reply=answer.texts[0],
        age_ms=age_ms_of(answer.at or 0.0),
    )


def told_by_robot(robot: Robot, command: Any, answer: Answer) -> RobotRawReply:
    """What a robot answered to a text."""
    return RobotRawReply(robot_id=robot.id, sent=robot.line.frame_of(command), replies=list(answer.texts))
