"""Commands as plain text, where the configuration allows it: the same scheduler, the same rules."""

from collections.abc import Mapping
from typing import Annotated, Any, Final

from pydantic import BaseModel, Field

from gateway.core.move_record import Move
from gateway.core.operation import Rows, Wait
from gateway.core.origin import current
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.targets import Answer, Result, Target
from gateway.core.times import age_ms_of
from gateway.door.doing import do, read_text
from gateway.door.keys import not_honoured
from gateway.door.names import RobotId
from gateway.door.results import StopResult
from gateway.fics.family import Fics
from gateway.fics.move_record import RobotMove
from gateway.fics.robot import Robot
from gateway.plant import Plant
from gateway.rorze.bodies import Body
from protocols.table import Effect

ROWS: Final = Rows("commands")


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


_OF_ROBOTS: Final[Mapping[str, Any]] = {
    "leased": False,
    "result": RobotRawReply | StopResult,
    "may_begin": RobotMove,
}


@ROWS.post("/bodies/{body_id}/raw", Right.SETUP, leased=False, result=RawReply | StopResult, may_begin=Move)
async def send_raw(
    plant: Plant, body: Body, target: Target, raw: RawRequest, *, wait: Wait = None, keyed: bool
) -> Any:
    """Send a command as text. A command that moves makes a move, and one that stops makes a stop."""
    command, result = await _do(plant, target, raw.text, wait, keyed=keyed)
    if not isinstance(result, Answer):
        return result
    return RawReply(
        body_id=body.address,
        sent=body.line.frame_of(body.number, command),
        reply=result.texts[0],
        age_ms=age_ms_of(result.at or 0.0),
    )


@ROWS.post("/robots/{robot_id}/raw", Right.SETUP, **_OF_ROBOTS)
async def send_robot_raw(
    plant: Plant, robot: Robot, target: Target, raw: RobotRawRequest, *, wait: Wait = None, keyed: bool
) -> Any:
    """Send a command as text. A command that moves makes a move, and one that stops makes a stop."""
    command, result = await _do(plant, target, raw.text, wait, keyed=keyed)
    if not isinstance(result, Answer):
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
    robot = plant.family(Fics).robot(robot_id)
    return await send_robot_raw(plant, robot, target, raw, wait=wait, keyed=keyed)


async def _do(
    plant: Plant, target: Target, text: str, wait: float | None, *, keyed: bool
) -> tuple[Any, Result]:
    """Carry out what a text says.

    :raises InvalidRequest: it is no stop, and its sender relies on a key; nothing was sent.
    """
    command = read_text(plant, target.path, text)
    if keyed and command.effect is not Effect.STOP:
        raise not_honoured()
    return command, await do(plant, current(), target.path, command, wait or 0.0)
