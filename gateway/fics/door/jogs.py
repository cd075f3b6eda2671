"""Jogs of robots, with a dead-man: an axis moves while heartbeats come twice a second."""

from typing import Final

from pydantic import Field

from gateway.core.operation import Rows
from gateway.core.origin import current
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.targets import Result
from gateway.door.doing import do
from gateway.fics.jogs import JogSession
from gateway.fics.robot import Robot
from gateway.plant import Plant
from protocols.fics.jog import StartJog
from protocols.fics.notation import AxisName, Direction, Unit
from protocols.table import Effect

ROWS: Final = Rows("jogs")


class JogRequest(RequestModel, json_schema_extra=example(unit=2, axis="X", direction="+")):
    """The axis to jog, and its direction (C-HOST manual 2-2)."""

    unit: Unit
    axis: AxisName = Field(description="X Y Z .. for a user axis, A B C .. for a motor axis, @ for theta.")
    direction: Direction


@ROWS.post("/robots/{robot_id}/jogs", Right.OPERATE, effect=Effect.MOTION, result=JogSession, opens=True)
async def start_jog(plant: Plant, robot: Robot, jog: JogRequest) -> Result:
    """Start to jog an axis. It stops when no heartbeat has come for half a second."""
    command = StartJog(axis=jog.axis, direction=jog.direction)
    return await do(plant, current(), f"/robots/{robot.id}/units/{jog.unit}", command)


@ROWS.post("/robots/{robot_id}/jogs/{jog_id}/heartbeat", Right.OPERATE)
async def keep_jogging(robot: Robot, jog_id: str) -> JogSession:
    """Let the axis move for another half second; 409 when it is being stopped, or cannot be reached."""
    return robot.jogs.heartbeat(jog_id)


@ROWS.post(
    "/robots/{robot_id}/jogs/{jog_id}/stop",
    Right.STOP,
    over="The axis was seen to stand still.",
    stopping="It may still move: the whole robot is being stopped.",
)
async def end_jog(robot: Robot, jog_id: str) -> JogSession:
    """Stop the axis, and answer when it stands still.

    Where that was not seen in time, the state is `stopping` and the whole robot is being stopped; ask again
    until the state is another.
    """
    return await robot.jogs.end(jog_id)
