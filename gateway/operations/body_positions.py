"""The position tables of bodies, and the names that the gateway keeps for their positions."""

from collections.abc import Mapping, Sequence
from functools import partial

from gateway.core.rights import Right
from gateway.operations.caller import needs
from gateway.plant import Plant
from gateway.rorze import positions
from gateway.rorze.bodies import Body
from gateway.rorze.family import Rorze
from gateway.rorze.position_uploads import TableUpload
from gateway.rorze.positions import NamedPosition, Position, PositionReading, Wanted


@needs(Right.VIEW)
async def read(plant: Plant, body_id: str, first: int, last: int) -> list[Position]:
    """Read positions; errors as of `positions.read`."""
    return await positions.read(plant.family(Rorze).body(body_id), first, last)


@needs(Right.VIEW)
async def begin_to_read(plant: Plant, body_id: str, first: int, last: int, wait_s: float) -> PositionReading:
    """Begin to read positions, and give the record after `wait_s` at most; errors as of `start`."""
    body = plant.family(Rorze).body(body_id)
    begun = plant.position_readings.start(body, first, last, partial(named, plant, body))
    await plant.position_readings.wait(begun, wait_s)
    return begun


@needs(Right.VIEW)
async def get_reading(plant: Plant, body_id: str, reading_id: str, wait_s: float) -> PositionReading:
    """Give a reading of positions, or the `current` one; errors as of `Works.get`."""
    return await plant.position_readings.get(_target(plant, body_id), reading_id, wait_s)


@needs(Right.VIEW)
async def cancel_reading(plant: Plant, body_id: str) -> PositionReading:
    """End the reading under way; errors as of `Readings.cancel`."""
    return await plant.position_readings.cancel(_target(plant, body_id))


def _target(plant: Plant, body_id: str) -> str:
    return f"/bodies/{plant.family(Rorze).body(body_id).address}"


@needs(Right.SETUP)
async def store(
    plant: Plant, body_id: str, wanted: Sequence[Wanted], names: Mapping[int, str], flash: bool
) -> list[Position]:
    """Store positions, and give them as they were read back; then name them.

    :raises BodyBusy: others are being stored; nothing was sent.
    :raises GatewayError: as of `positions.store`.
    """
    body = plant.family(Rorze).body(body_id)
    plant.position_uploads.require_none(_target(plant, body_id))
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


@needs(Right.VIEW)
async def get_upload(plant: Plant, body_id: str, upload_id: str, wait_s: float) -> TableUpload:
    """Give an upload of positions, or the `current` one; errors as of `Works.get`."""
    return await plant.position_uploads.get(_target(plant, body_id), upload_id, wait_s)


@needs(Right.SETUP)
async def cancel_upload(plant: Plant, body_id: str) -> TableUpload:
    """End the upload under way; errors as of `Readings.cancel`."""
    return await plant.position_uploads.cancel(_target(plant, body_id))


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
