"""What is asked of SCARA robots: where they are, kinematics, geometry, paths, and moves."""

from collections.abc import Mapping, Sequence

from gateway.core.rights import Right
from gateway.operations.caller import needs
from gateway.plant import Plant
from gateway.rorze.family import Rorze
from gateway.rorze.scaras import geometry, paths
from gateway.rorze.scaras.geometry import HeldGeometry
from gateway.rorze.scaras.record import PlannedScaraMove, ScaraMove
from gateway.rorze.scaras.requests import ScaraMoveRequest
from gateway.rorze.scaras.scara import AxisPositions, Scara
from gateway.rorze.scaras.speed import at_own_speed
from protocols.rorze.interpolation import PathPoint
from protocols.rorze.scara import Place


@needs(Right.VIEW)
async def stand(plant: Plant, scara_id: str) -> AxisPositions:
    """Ask all axes in one frame where they stand; errors as of `Scara.ask`."""
    return await _scara(plant, scara_id).stand()


def forward(plant: Plant, scara_id: str, pulses: Sequence[float]) -> Place:
    """Calculate where the finger ends; nothing is sent. Errors as of `Scara.place_of`."""
    return _scara(plant, scara_id).place_of(pulses)


def inverse(plant: Plant, scara_id: str, place: Place, *, is_turned: bool) -> tuple[int, ...]:
    """Calculate the positions of the axes; nothing is sent. Parameters and errors as of `Scara.pulses_of`."""
    return _scara(plant, scara_id).pulses_of(place, is_turned=is_turned)


@needs(Right.VIEW)
async def read_geometry(plant: Plant, scara_id: str) -> list[HeldGeometry]:
    """Ask the controllers for their geometry; errors as of `Scara.ask`."""
    return await geometry.read(_scara(plant, scara_id))


@needs(Right.SETUP)
async def apply_geometry(plant: Plant, scara_id: str, flash: bool) -> list[HeldGeometry]:
    """Give the controllers the configured geometry; errors as of `geometry.write`."""
    return await geometry.write(_scara(plant, scara_id), flash=flash)


@needs(Right.VIEW)
async def read_path(plant: Plant, scara_id: str, path: int) -> Mapping[int, PathPoint]:
    """Read a stored path; errors as of `paths.read`."""
    return await paths.read(_scara(plant, scara_id), path)


@needs(Right.SETUP)
async def write_path(
    plant: Plant, scara_id: str, path: int, points: Sequence[PathPoint]
) -> Mapping[int, PathPoint]:
    """Store a path in all controllers; errors as of `paths.write`."""
    return await paths.write(_scara(plant, scara_id), path, points)


@needs(Right.OPERATE)
async def start_move(
    plant: Plant, scara_id: str, request: ScaraMoveRequest, wait_s: float = 0.0
) -> ScaraMove | PlannedScaraMove:
    """Start a move, or work out what it would be; errors as of `ScaraMoves.start`."""
    moves, scara = plant.family(Rorze).scara_moves, _scara(plant, scara_id)
    if request.validate_only:
        return await moves.plan(scara, request)
    plant.require_unlatched(scara_id)
    async with at_own_speed(scara, request) as ready:
        move = await moves.start(scara, ready)
    return await moves.log.wait(move.id, wait_s)


def _scara(plant: Plant, scara_id: str) -> Scara:
    return plant.family(Rorze).scara(scara_id)
