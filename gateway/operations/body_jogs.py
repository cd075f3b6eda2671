"""Jogs of bodies: a motor moves for as long as somebody says so twice a second."""

from gateway.core.rights import Right
from gateway.core.targets import Opened
from gateway.operations.caller import needs
from gateway.plant import Plant
from gateway.rorze.family import Rorze
from gateway.rorze.jogs import BodyJog, BodyJogRequest


@needs(Right.OPERATE)
async def start(plant: Plant, body_id: str, request: BodyJogRequest) -> Opened:
    """Start to jog a body; errors as of `BodyJogs.start`."""
    rorze = plant.family(Rorze)
    body = rorze.body(body_id)
    plant.require_unlatched(body.address)
    jog = await rorze.jogs.start(body, request)
    return Opened(f"/bodies/{body.address}/jogs/{jog.id}", jog)


@needs(Right.OPERATE)
async def heartbeat(plant: Plant, body_id: str, jog_id: str) -> BodyJog:
    """Let the motor move for another half second; errors as of `BodyJogs.heartbeat`."""
    rorze = plant.family(Rorze)
    return rorze.jogs.heartbeat(rorze.body(body_id), jog_id)


@needs(Right.STOP)
async def end(plant: Plant, body_id: str, jog_id: str) -> BodyJog:
    """Stop the motor, and give the jog when it stands still; errors as of `BodyJogs.end`."""
    rorze = plant.family(Rorze)
    return await rorze.jogs.end(rorze.body(body_id), jog_id)
