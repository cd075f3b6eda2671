"""The position tables of bodies, and the names that the gateway keeps for their positions."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Final

from gateway.core.rights import Right
from gateway.operations.caller import address_of, needs
from gateway.operations.of_bodies import of_body
from gateway.operations.records import Records
from gateway.plant import Plant
from gateway.rorze import positions
from gateway.rorze.bodies import Body
from gateway.rorze.family import Rorze
from gateway.rorze.position_uploads import TableUpload
from gateway.rorze.positions import NamedPosition, Position, PositionReading, Wanted

read: Final = of_body(Right.VIEW, positions.read)


@needs(Right.VIEW)
async def begin_to_read(plant: Plant, body_id: str, first: int, last: int, wait_s: float) -> PositionReading:
    """Begin to read positions, and give the record after `wait_s` at most; errors as of `start`."""
    body = plant.family(Rorze).body(body_id)
    begun = plant.position_readings.start(body, first, last, partial(named, plant, body))
    await plant.position_readings.wait(begun, wait_s)
    return begun


@needs(Right.SETUP)
async def store(
    plant: Plant, body_id: str, wanted: Sequence[Wanted], names: Mapping[int, str], flash: bool
) -> list[Position]:
    """Store positions, and give them as they were read back; then name them.

    :raises BodyBusy: others are being stored; nothing was sent.
    :raises GatewayError: as of `positions.store`.
    """
    body = plant.family(Rorze).body(body_id)
    plant.position_uploads.require_none(f"/bodies/{body.address}")
    held = await positions.store(body, wanted, flash=flash)
    await plant.names.name(body.address, names)
    return held


@needs(Right.SETUP)
async def begin_to_store(
    plant: Plant, body_id: str, wanted: Sequence[Wanted], names: Mapping[int, str], flash: bool, wait_s: float
) -> TableUpload:
    """Begin to store and name positions, and give the record after `wait_s` at most; errors as of `start`."""
    body = plant.family(Rorze).body(body_id)

    async def name_all(held: Sequence[Position]) -> list[NamedPosition]:
        await plant.names.name(body.address, names)
        return [named(plant, body, it) for it in held]

    begun = plant.position_uploads.start(body, wanted, flash=flash, named=name_all)
    await plant.position_uploads.wait(begun, wait_s)
    return begun


@needs(Right.SETUP)
async def name(plant: Plant, body_id: str, number: int, name: str) -> None:
    """Name a position, or with an empty name take its name away."""
    await plant.names.name(plant.family(Rorze).body(body_id).address, {number: name})


def named(plant: Plant, body: Body, position: Position) -> NamedPosition:
    """A position with its name, and in the unit of the body's scale."""
    scale = body.scale
    return NamedPosition(
        number=position.number,
        name=plant.names.of(body.address).get(position.number),
        pulses=position.pulses,
        value=None if scale is None else scale.value(position.pulses),
        unit=None if scale is None else scale.unit,
    )


def _path(plant: Plant, path: str) -> str:
    return f"/bodies/{plant.family(Rorze).body(address_of(path)).address}"


READINGS: Final = Records(lambda plant, path: (plant.position_readings, _path(plant, path)), Right.VIEW)
UPLOADS: Final = Records(lambda plant, path: (plant.position_uploads, _path(plant, path)), Right.SETUP)
