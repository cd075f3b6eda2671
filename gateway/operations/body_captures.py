"""Captures of bodies: armed, waited for, read."""

from gateway.core.rights import Right
from gateway.operations.caller import needs
from gateway.plant import Plant
from gateway.rorze import captures
from gateway.rorze.captures import INPUTS, Capture, CaptureRequest
from gateway.rorze.family import Rorze


@needs(Right.VIEW)
async def read_all(plant: Plant, body_id: str) -> list[Capture]:
    """Read the captures of both inputs; errors as of `captures.read`."""
    body = plant.family(Rorze).body(body_id)
    return [await captures.read(body, port) for port in INPUTS]


@needs(Right.OPERATE)
async def arm(plant: Plant, body_id: str, port: int, wanted: CaptureRequest) -> Capture:
    """Let an input capture in the next move; errors as of `captures.arm`."""
    return await captures.arm(plant.family(Rorze).body(body_id), port, wanted)


@needs(Right.OPERATE)
async def disarm(plant: Plant, body_id: str, port: int) -> Capture:
    """Let an input capture nothing; errors as of `captures.disarm`."""
    return await captures.disarm(plant.family(Rorze).body(body_id), port)


@needs(Right.VIEW)
async def wait(plant: Plant, body_id: str, port: int, within_s: float) -> Capture:
    """Give a capture when it is over, or the time is up; errors as of `captures.wait`."""
    return await captures.wait(plant.family(Rorze).body(body_id), port, within_s)
