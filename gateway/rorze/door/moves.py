"""Moves of bodies and groups: started, planned, listed and waited for; and where a body was seen in one."""

from typing import Final

from pydantic import BaseModel

from gateway.core.move_record import Move, MoveRecord
from gateway.core.operation import PlainText, Rows, Wait
from gateway.core.origin import current
from gateway.core.records import AnswerModel
from gateway.core.rights import Right
from gateway.core.targets import Opened, Result, Stopped, Target
from gateway.door import moving, stopping
from gateway.door.csv_tables import CSV, csv_of
from gateway.door.moving import Limit
from gateway.door.results import GroupMove, StopResult
from gateway.door.stops import SLOWLY, StopRequest
from gateway.plant import Plant
from gateway.rorze.bodies import Body
from gateway.rorze.family import BodyId, GroupId, Rorze
from gateway.rorze.move_requests import BodyJog, BodyJogRequest, MoveRequest, SpeedRequest
from gateway.rorze.plans import GroupPlan, PlannedMove
from gateway.rorze.samples import BodySamples
from protocols.table import Effect

ROWS: Final = Rows("moves")
SAMPLES: Final = Rows("samples")
SAMPLES_AS_CSV: Final = Rows("samples")


class MoveList(AnswerModel):
    """Moves of a body, newest first."""

    moves: list[Move]


@ROWS.post(
    "/bodies/{body_id}/moves",
    Right.OPERATE,
    moves=True,
    result=Move,
    planned=PlannedMove,
)
async def start_move(
    plant: Plant, target: Target, move: MoveRequest, *, wait: Wait = None
) -> Result | BaseModel:
    """Start a move, or with `validate_only` say what it would be.

    202 when the controller has accepted it and it is not over, 200 when it ended while the request waited. A
    move that has started and failed is no HTTP error: see its `status`, `end_cause` and `error`.
    """
    return await moving.start(plant, target, move, wait or 0.0)


@ROWS.get("/bodies/{body_id}/moves")
async def list_moves(target: Target, *, limit: Limit = 100) -> MoveList:
    """List the body's moves, newest first."""
    return MoveList(moves=moving.newest(target, limit))


@ROWS.get("/bodies/{body_id}/moves/{move_id}", result=Move)
async def get_move(target: Target, move_id: str, *, wait: Wait = None) -> MoveRecord:
    """Get a move, at once or when it is over."""
    return await moving.get(target, move_id, wait or 0.0)


@ROWS.post("/bodies/{body_id}/moves/{move_id}/speed", Right.OPERATE, result=Move, later=True)
async def change_speed_of_one_move(target: Target, move_id: str, speed: SpeedRequest) -> MoveRecord:
    """Change the speed of this move on its way (5AS, 5CS, 5DS); 409 when it is over, or homes."""
    return await moving.change_speed(target, move_id, speed.command())


@ROWS.post(
    "/groups/{group_id}/moves",
    Right.OPERATE,
    moves=True,
    result=GroupMove,
    planned=GroupPlan,
)
async def start_group_move(
    plant: Plant, target: Target, move: MoveRequest, *, wait: Wait = None
) -> Result | BaseModel:
    """Start a move of all members of a group by one command; each has a move of its own."""
    return await moving.start(plant, target, move, wait or 0.0)


@SAMPLES.get("/bodies/{body_id}/moves/{move_id}/samples")
async def get_samples(target: Target, move_id: str) -> BodySamples:
    """Get where a body was seen during a move, and where the plan has it, for the settings of the move.

    The settings for the plan are read from the controller at the first request for the samples. The newest
    200 moves have samples until the gateway ends; one that is under way has those until now.
    """
    told: BodySamples = await moving.samples(target, move_id)
    return told


@SAMPLES_AS_CSV.get("/bodies/{body_id}/moves/{move_id}/samples.csv", media=CSV)
async def download_samples(target: Target, move_id: str) -> PlainText:
    """Get the same as CSV: time, time_s, pulses, the planned pulses, and the value in the body's unit."""
    told: BodySamples = await moving.samples(target, move_id)
    scaled = [f"value {told.unit}"] if told.unit else []
    rows = (
        [
            sample.time.isoformat(),
            sample.time_s,
            sample.pulses,
            sample.planned_pulses,
            *([sample.value] if scaled else []),
        ]
        for sample in told.samples
    )
    return PlainText(csv_of(["time", "time_s", "pulses", "planned_pulses", *scaled], rows))


JOGS: Final = Rows("jogs")


@JOGS.post("/bodies/{body_id}/jogs", Right.OPERATE, effect=Effect.MOTION, result=BodyJog, opens=True)
async def start_body_jog(plant: Plant, body: Body, jog: BodyJogRequest) -> Opened:
    """Start to jog a body. It stops when no heartbeat has come for half a second.

    It is a move of the same id, no further than `at_most`, 10 s at its top speed, or a soft limit.
    """
    plant.require_unlatched(body.address)
    begun = await plant.family(Rorze).jogs.start(body, jog)
    return Opened(f"/bodies/{body.address}/jogs/{begun.id}", begun)


@JOGS.post("/bodies/{body_id}/jogs/{jog_id}/heartbeat", Right.OPERATE)
async def keep_jogging_body(rorze: Rorze, body: Body, jog_id: str) -> BodyJog:
    """Let the motor move for another half second; 409 when it is being stopped, or cannot be reached."""
    return rorze.jogs.heartbeat(jog_id, body)


@JOGS.post(
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


STOPS: Final = Rows("stops")


@STOPS.post("/bodies/{body_id}/stop", Right.STOP, result=StopResult)
async def stop_body(plant: Plant, body_id: BodyId, stop: StopRequest = SLOWLY) -> Stopped:
    """Stop a body by software: what waits is cancelled, and the stop goes out at the next frame boundary."""
    return await stopping.stop(plant, current(), f"/bodies/{body_id}", stop.mode)


@STOPS.post("/groups/{group_id}/stop", Right.STOP, result=StopResult)
async def stop_group(plant: Plant, group_id: GroupId, stop: StopRequest = SLOWLY) -> Stopped:
    """Stop all members of a group by software, with one frame for all and then one for each."""
    return await stopping.stop(plant, current(), f"/groups/{group_id}", stop.mode)
