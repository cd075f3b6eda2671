"""The position tables of bodies, and the names that the gateway keeps for their positions."""

from collections.abc import Mapping, Sequence

from gateway.core.rights import Right
from gateway.operations.caller import needs
from gateway.plant import Plant
from gateway.rorze import positions
from gateway.rorze.family import Rorze
from gateway.rorze.positions import Position, Wanted


@needs(Right.VIEW)
async def read(plant: Plant, body_id: str, first: int, last: int) -> list[Position]:
    """Read positions; errors as of `positions.read`."""
    return await positions.read(plant.family(Rorze).body(body_id), first, last)


@needs(Right.SETUP)
async def store(
    plant: Plant, body_id: str, wanted: Sequence[Wanted], names: Mapping[int, str], flash: bool
) -> list[Position]:
    """Store positions, and give them as they were read back; then name them.

    Errors as of `positions.store`.
    """
    body = plant.family(Rorze).body(body_id)
    held = await positions.store(body, wanted, flash=flash)
    await plant.names.name(body.address, names)
    return held


@needs(Right.SETUP)
async def name(plant: Plant, body_id: str, number: int, name: str) -> None:
    """Name a position, or with an empty name take its name away."""
    await plant.names.name(plant.family(Rorze).body(body_id).address, {number: name})


def names(plant: Plant, body_id: str) -> Mapping[int, str]:
    """The names of the body's positions."""
    return plant.names.of(plant.family(Rorze).body(body_id).address)
