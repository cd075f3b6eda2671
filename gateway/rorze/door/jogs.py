"""Jogs of bodies, with a dead-man: what moves, moves while somebody says so twice a second."""

from typing import Final

from gateway.core.operation import Rows
from gateway.core.rights import Right
from gateway.core.targets import Opened
from gateway.plant import Plant
from gateway.rorze.bodies import Body
from gateway.rorze.family import Rorze
from gateway.rorze.jogs import BodyJog, BodyJogRequest
from protocols.table import Effect

ROWS: Final = Rows("jogs")


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
