"""Jogs of bodies and of robots, with a dead-man: what moves, moves while somebody says so twice a second."""

from typing import Final

from pydantic import Field

from gateway.core.operation import Rows
from gateway.core.origin import current
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.targets import Opened, Result
from gateway.door.doing import do
from gateway.fics.jogs import JogSession
from gateway.fics.robot import Robot
from gateway.plant import Plant
from gateway.rorze.bodies import Body
from gateway.rorze.family import Rorze
from gateway.rorze.jogs import BodyJog, BodyJogRequest
from protocols.fics.jog import StartJog
from protocols.fics.notation import AxisName, Direction, Unit
from protocols.table import Effect

ROWS: Final = Rows("jogs")
OF_ROBOTS: Final = Rows("jogs")


@ROWS.post("/bodies/{body_id}/jogs", Right.OPERATE, effect=Effect.MOTION, result=BodyJog, opens=True)
async def start_body_jog(plant: Plant, body: Body, jog: BodyJogRequest) -> Opened:
    """Start to jog a body. It stops when no heartbeat has come for half a second.

    It is a move of the same id, no further than `at_most`, 10 s at its top speed, or a soft limit.
    """
    plant.require_unlatched(body.address)
    begun = await plant.family(Rorze).jogs.start(body, jog)
    return Opened(f"/bodies/{body.address}/jogs/{begun.id}", begun)


@ROWS.post("/bodies/{body_id}/jogs/{jog_id}/heartbeat", Right.OPERATE)
async def keep_jogging_body(rorze: Rorze, body: Body, jog_id: str) -> BodyJog:
    """Let the motor move for another half second; 409 when it is being stopped, or nobody can reach it."""
    return rorze.jogs.heartbeat(jog_id, body)


@ROWS.post(
    "/bodies/{body_id}/jogs/{jog_id}/stop",
    Right.STOP,
    over="The motor was seen to stand still.",
    stopping="It may still move: the stop is repeated.",
)
async def end_body_jog(rorze: Rorze, body: Body, jog_id: str) -> BodyJog:
    """Stop the motor, and answer when it stands still.

    Where that was not seen in time, the state is `stopping`; ask again until the state is another.
    """
    return await rorze.jogs.end(jog_id, body)


class JogRequest(RequestModel, json_schema_extra=example(unit=2, axis="X", direction="+")):
    """Which axis to jog, and which way (C-HOST manual 2-2)."""

    unit: Unit
    axis: AxisName = Field(description="X Y Z .. for a user axis, A B C .. for a motor axis, @ for theta.")
    direction: Direction


@OF_ROBOTS.post("/robots/{robot_id}/jogs", Right.OPERATE, effect=Effect.MOTION, result=JogSession, opens=True)
async def start_jog(plant: Plant, robot: Robot, jog: JogRequest) -> Result:
    """Start to jog an axis. It stops when no heartbeat has come for half a second."""
    command = StartJog(axis=jog.axis, direction=jog.direction)
    return await do(plant, current(), f"/robots/{robot.id}/units/{jog.unit}", command)


@OF_ROBOTS.post("/robots/{robot_id}/jogs/{jog_id}/heartbeat", Right.OPERATE)
async def keep_jogging(robot: Robot, jog_id: str) -> JogSession:
    """Let the axis move for another half second; 409 when it is being stopped, or nobody can reach it."""
    return robot.jogs.heartbeat(jog_id)


@OF_ROBOTS.post(
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
