"""A fault of the gateway itself, at any place, leaves nobody waiting and no motor without its stop."""

import asyncio

import pytest

from gateway.core.gate import Gate
from gateway.core.load import Load
from gateway.core.move_record import MoveStatus
from gateway.core.scheduler import Scheduler
from gateway.core.session import Session
from gateway.core.stops import Stopping
from gateway.fics.move_runs import MoveRun
from gateway.rorze.bodies import Body
from gateway.rorze.body_watch import BodyWatch
from gateway.rorze.move_proof import MoveProof
from gateway.rorze.moves import Moves
from gateway.rorze.session import RorzeSession
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveRelative
from protocols.fics.system import GetSystemVersion
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from tests.fics_plants import fics_rig
from tests.own_faults import Place, fail_once, named
from tests.plants import Rig, in_virtual_time, rig

LONG = MoveClockwise(distance=20_000)
SHORT = MoveClockwise(distance=300)
AGAIN_S = 30.0
"""After this time the gateway is itself again, whatever has happened."""


async def is_itself(it: Rig) -> None:
    """Each body answers, moves, and is stopped with a confirmation."""
    for body in it.plant.bodies():
        await body.ask(GetPosition())
        [move] = await it.plant.moves.start(body, SHORT)
        assert (await it.plant.moves.wait(move.id, 60.0)).status is MoveStatus.SUCCEEDED
        [report] = await it.plant.stops.stop([body], "immediate")
        assert report.state == "confirmed"


@pytest.mark.parametrize(
    "place",
    [
        (Session, "has_something"),
        (Session, "next"),
        (Session, "written"),
        (Session, "pass_deadlines"),
        (Session, "_ended"),
        (RorzeSession, "receive"),
        (RorzeSession, "was_written"),
        (Gate, "refuses"),
        (Scheduler, "next"),
        (Load, "note"),
        (Body, "note_sent"),
        (Body, "note_reply"),
        (Body, "was_set_going"),
        (BodyWatch, "_attend"),
        (MoveProof, "know_the_start"),
        (MoveProof, "running"),
        (MoveProof, "at_rest"),
        (Moves, "_write"),
        (Moves, "_advance"),
        (Stopping, "_is_proved"),
        (Stopping, "_repeat"),
    ],
    ids=named,
)
@in_virtual_time
async def test_a_fault_amid_moves_and_stops_of_bodies_is_survived(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig(bodies=(0x00, 0x3F), groups={}) as it:
        await asyncio.sleep(3.0)
        failed = fail_once(monkeypatch, place)
        moving = asyncio.gather(it.plant.moves.start(it.body(), LONG), return_exceptions=True)
        asking = asyncio.gather(it.plant.body("00").ask(GetPosition()), return_exceptions=True)
        await asyncio.sleep(0.7)
        stopping = asyncio.gather(it.plant.stops.stop([it.body()], "decelerate"), return_exceptions=True)
        await asyncio.sleep(AGAIN_S)
        assert moving.done()
        assert asking.done()
        assert stopping.done()
        assert failed
        assert it.body().move is None
        assert not it.axis().motor.moving
        await is_itself(it)


@pytest.mark.parametrize(
    "place",
    [
        (Session, "next"),
        (Session, "written"),
        (Session, "_ended"),
        (Gate, "refuses"),
        (Load, "note"),
        (MoveRun, "make"),
        (MoveRun, "_follow"),
        (Stopping, "_is_proved"),
    ],
    ids=named,
)
@in_virtual_time
async def test_a_fault_amid_moves_and_stops_of_a_robot_is_survived(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with fics_rig() as it:
        assert (await it.move(HomeRobot())).status is MoveStatus.SUCCEEDED
        failed = fail_once(monkeypatch, place)
        moving = asyncio.gather(
            it.start(MoveRelative(coordinates=[90.0, None, None])), return_exceptions=True
        )
        asking = asyncio.gather(it.robot.ask(GetSystemVersion()), return_exceptions=True)
        await asyncio.sleep(0.7)
        stopping = asyncio.gather(it.robot.stop("decelerate"), return_exceptions=True)
        await asyncio.sleep(AGAIN_S)
        assert moving.done()
        assert asking.done()
        assert stopping.done()
        assert failed
        assert it.robot.motion.idle.is_set()
        assert (await it.move(MoveRelative(coordinates=[5.0, None, None]))).status is MoveStatus.SUCCEEDED
        assert (await it.robot.stop("immediate")).state == "confirmed"
