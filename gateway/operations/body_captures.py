"""Captures of bodies: armed, waited for, read."""

from typing import Final

from gateway.core.rights import Right
from gateway.operations.caller import needs
from gateway.operations.of_bodies import of_body
from gateway.plant import Plant
from gateway.rorze import captures
from gateway.rorze.captures import INPUTS, Capture
from gateway.rorze.family import Rorze


@needs(Right.VIEW)
async def read_all(plant: Plant, body_id: str) -> list[Capture]:
    """Read the captures of both inputs; errors as of `captures.read`."""
    body = plant.family(Rorze).body(body_id)
    return [await captures.read(body, port) for port in INPUTS]


arm: Final = of_body(Right.OPERATE, captures.arm)
disarm: Final = of_body(Right.OPERATE, captures.disarm)
wait: Final = of_body(Right.VIEW, captures.wait)
