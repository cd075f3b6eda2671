"""The loop was held while replies lay in the port's buffer: no controller is silent or late because of it."""

import asyncio
import re

import pytest

from gateway.core.alarms import DISPROVED
from gateway.core.stops import CONFIRM_WITHIN_S
from gateway.rorze.move_requests import BodyJogRequest
from protocols.fics.homing import HomeRobot
from protocols.rorze.moves import MoveClockwise
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import Rig, in_virtual_time, rig, start
from tests.simulated_line import SimulatedCable
from tests.tested_plant import TestedPlant
from tests.virtual_time import VirtualLoop

HELD_S = 1.0
"""Longer than a reply is waited for."""
FAR = MoveClockwise(distance=900_000)
SERIOUS = ("line.down", "body.offline", "robot.offline", "body.stop.unconfirmed", "robot.stop.unconfirmed")


class Holds:
    """After each of the next frames the loop does nothing for a while; the reply comes meanwhile."""

    def __init__(self) -> None:
        self.left = 0

    def after(self, frames: int, plant: TestedPlant) -> None:
        self.left = frames
        plant.admission.watch._clock = asyncio.get_running_loop().time
        plant.admission.watch.start()

    def pass_one(self) -> None:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, VirtualLoop)
        if self.left:
            self.left -= 1
            loop.be_held_for(HELD_S)


@pytest.fixture
def holds(monkeypatch: pytest.MonkeyPatch) -> Holds:
    holds, write = Holds(), SimulatedCable.write

    def write_and_be_held(cable: SimulatedCable, data: bytes) -> None:
        write(cable, data)
        holds.pass_one()

    monkeypatch.setattr(SimulatedCable, "write", write_and_be_held)
    return holds


def require_no_alarm(it: Rig | FicsRig) -> None:
    assert [alarm.cause for alarm in it.plant.alarms.standing() if alarm.cause in SERIOUS] == []
    assert it.plant.alarms.history() == []


def test_a_body_whose_replies_lay_in_the_buffer_is_not_silent(holds: Holds) -> None:
    @in_virtual_time
    async def story() -> None:
        async with rig() as it:
            holds.after(30, it.plant)
            await asyncio.sleep(60.0)
            assert holds.left == 0
            assert it.plant.line("line1").counters["timeouts"] == 0
            require_no_alarm(it)

    story()


def test_a_robot_whose_answers_lay_in_the_buffer_is_not_silent(holds: Holds) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig() as it:
            holds.after(20, it.plant)
            await asyncio.sleep(60.0)
            assert holds.left == 0
            assert it.robot.line.counters["timeouts"] == 0
            require_no_alarm(it)

    story()


def test_the_stop_of_a_body_is_not_late_because_the_loop_was(holds: Holds) -> None:
    @in_virtual_time
    async def story() -> None:
        async with rig() as it:
            await start(it, FAR)
            await asyncio.sleep(0.5)
            holds.after(3, it.plant)
            await it.plant.stops.stop([it.body()], "immediate")
            await it.plant.stops.confirmed()
            require_no_alarm(it)

    story()


def test_the_stop_of_a_robot_is_not_late_because_the_loop_was(holds: Holds) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig() as it:
            await it.move(HomeRobot())
            holds.after(3, it.plant)
            report = await it.robot.stop("immediate")
            await asyncio.sleep(5.0)
            assert report.state == "confirmed"
            require_no_alarm(it)

    story()


def test_a_line_of_which_all_answered_meanwhile_is_not_down(holds: Holds) -> None:
    @in_virtual_time
    async def story() -> None:
        async with rig(bodies=range(5), groups={}) as it:
            stopping = it.plant.stops.stop(it.plant.bodies(), "immediate")
            holds.after(12, it.plant)
            await stopping
            await asyncio.sleep(20.0)
            assert it.types("line.down") == []
            assert it.types("line.stops.unconfirmed") == []
            require_no_alarm(it)

    story()


def test_a_jog_whose_heartbeats_lay_in_their_sockets_is_stopped_and_alarms_nobody(holds: Holds) -> None:
    """A dead man's switch does not wait for the gateway: the age of the heartbeat cannot be known."""

    @in_virtual_time
    async def story() -> None:
        async with rig() as it:
            jogs = it.plant.rorze.jogs
            jog = await jogs.start(it.body(), BodyJogRequest(direction="cw"))
            holds.after(2, it.plant)
            await asyncio.sleep(CONFIRM_WITHIN_S + 2 * HELD_S)
            assert (jog.state, jog.ends_as) == ("lost", "lost")
            require_no_alarm(it)

    story()


def test_a_body_that_is_silent_itself_is_told_in_spite_of_holds(holds: Holds) -> None:
    @in_virtual_time
    async def story() -> None:
        async with rig() as it:
            it.machine.switch_body(0x3F, on=False, now=asyncio.get_running_loop().time())
            holds.after(3, it.plant)
            await asyncio.sleep(30.0)
            assert [event.subject for event in it.events("body.offline")] == ["/bodies/line1.3F"]

    story()


@in_virtual_time
async def test_the_alarm_of_a_body_that_answers_before_it_is_given_up_ends_itself_as_a_note() -> None:
    async with rig() as it:
        told = it.plant.events.subscribe(types=["body.offline"])
        it.wire.deaf_to = re.compile(rb">&3F[^\r]*\r")
        await anext(told)
        it.wire.deaf_to = None
        await asyncio.sleep(5.0)
        assert it.body().online
        assert it.plant.alarms.standing() == []
        [note] = it.plant.alarms.history()
        assert (note.cause, note.reset_by) == ("body.offline", DISPROVED)


@in_virtual_time
async def test_the_alarm_of_a_body_that_was_given_up_stands_until_it_is_reset() -> None:
    async with rig() as it:
        it.wire.deaf_to = re.compile(rb">&3F[^\r]*\r")
        await asyncio.sleep(20.0)
        it.wire.deaf_to = None
        await asyncio.sleep(20.0)
        assert it.body().online
        [alarm] = it.plant.alarms.standing()
        assert (alarm.cause, alarm.ended_at is None) == ("body.offline", False)
