"""Moves of SCARA robots: started, planned, listed and waited for."""

from typing import Final

from gateway.core.move_record import MoveRecord
from gateway.core.operation import Rows, Wait
from gateway.core.origin import current
from gateway.core.records import AnswerModel
from gateway.core.rights import Right
from gateway.core.targets import BegunMoves, Stopped, Target
from gateway.door import moving, stopping
from gateway.door.moving import Limit
from gateway.door.results import StopResult
from gateway.door.stops import SLOWLY, StopRequest
from gateway.plant import Plant
from gateway.rorze_scara.extension import ScaraId, Scaras
from gateway.rorze_scara.preparation import at_own_speed
from gateway.rorze_scara.record import PlannedScaraMove, ScaraMove, ScaraSamples
from gateway.rorze_scara.requests import ScaraMoveRequest
from gateway.rorze_scara.scara import Scara

ROWS: Final = Rows("scara moves")


class ScaraMoveList(AnswerModel):
    """Moves of a robot, newest first."""

    moves: list[ScaraMove]


@ROWS.post(
    "/scaras/{scara_id}/moves",
    Right.OPERATE,
    moves=True,
    result=ScaraMove,
    planned=PlannedScaraMove,
)
async def start_scara_move(
    plant: Plant, scara: Scara, move: ScaraMoveRequest, *, wait: Wait = None
) -> BegunMoves | PlannedScaraMove:
    """Start a move of all axes, or with `validate_only` say what it would be.

    In one undivided turn of the line the gateway reads where the axes stand (6PD), tells all controllers
    (HPS), prepares the move, sees that they agree and that nothing has moved, and starts it by one frame
    (HMM; HFM and HNM for `finger` and `align`). 202 when it is accepted and not over, 200 when it ended while
    the request waited. When one axis fails all are stopped: see `status`, `failed_axes` and `error`.
    """
    scara_moves = plant.family(Scaras).moves
    if move.validate_only:
        return await scara_moves.plan(scara, move)
    plant.require_unlatched(scara.id)
    async with at_own_speed(scara, move) as ready:
        begun = await scara_moves.start(scara, ready)
    return BegunMoves(f"/scaras/{scara.id}", [await scara_moves.log.wait(begun.id, wait or 0.0)])


@ROWS.get("/scaras/{scara_id}/moves")
async def list_scara_moves(target: Target, *, limit: Limit = 100) -> ScaraMoveList:
    """List the robot's moves, newest first."""
    return ScaraMoveList(moves=moving.newest(target, limit))


@ROWS.get("/scaras/{scara_id}/moves/{move_id}", result=ScaraMove)
async def get_scara_move(target: Target, move_id: str, *, wait: Wait = None) -> MoveRecord:
    """Get a move, at once or when it is over."""
    return await moving.get(target, move_id, wait or 0.0)


@ROWS.get("/scaras/{scara_id}/moves/{move_id}/samples")
async def get_scara_samples(target: Target, move_id: str) -> ScaraSamples:
    """Get where the axes were seen during a move, and where the plan has each, along the path or alone.

    The settings for the plan are read from the controllers at the first request for the samples.
    """
    told: ScaraSamples = await moving.samples(target, move_id)
    return told


STOPS: Final = Rows("scaras")


@STOPS.post("/scaras/{scara_id}/stop", Right.STOP, result=StopResult)
async def stop_scara(plant: Plant, scara_id: ScaraId, stop: StopRequest = SLOWLY) -> Stopped:
    """Stop all axes of a robot by software, with one frame for all and then one for each."""
    return await stopping.stop(plant, current(), f"/scaras/{scara_id}", stop.mode)
