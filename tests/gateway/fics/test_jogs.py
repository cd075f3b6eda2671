"""JOG goes on for as long as its heartbeat does, and no longer."""

import asyncio
import itertools
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest

from gateway.core.errors import ControllerRefused, InvalidRequest, NoReply, NotFound, StoppedFirst
from gateway.core.events import Data, Event
from gateway.core.jogs import JogOutOfReach, JogOver
from gateway.core.supervisor import do_in_turn
from gateway.fics.errors import RobotBusy, UnitNotSelected
from gateway.fics.jogs import JogSession
from gateway.fics.robot import Robot
from protocols.fics.homing import HomeRobot
from protocols.fics.jog import StartJog
from protocols.fics.moves import MoveRelative
from protocols.fics.speeds import SetDecelerationTimes, SetMaximumSpeeds
from protocols.fics.variables import GetVariable
from simulator.faults import Direction, Fault
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time

ENDED, LOST, STOPPED = (
    ["robot.jog.started", "robot.jog.stopping", f"robot.jog.{end}"] for end in ("ended", "lost", "stopped")
)
SLOW_TO_STOP = (
    SetMaximumSpeeds(speeds=[None, None, 400.0]),
    SetDecelerationTimes(times_ms=[None, None, 9999]),
)
"""Z takes seconds to come to rest."""


@pytest.mark.parametrize("mode", [2, 3])
def test_an_axis_jogs_while_the_heartbeat_lasts(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await rig.move(HomeRobot())
            session = await rig.robot.jogs.start(1, "Z", "-")
            for _ in range(4):
                await asyncio.sleep(0.4)
                rig.robot.jogs.heartbeat(session.id)
            assert rig.fics.job is not None
            assert rig.robot.moving
            ended = await rig.robot.jogs.end(session.id)
            assert ended.state == "ended"
            assert rig.fics.job is None
            assert not rig.robot.moving

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_an_axis_that_jogs_although_its_start_was_refused_is_stopped(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await rig.move(HomeRobot())
            doubled = StartJog(axis="Z", direction="-").text
            rig.cable.damaged[doubled] = f"{doubled}\r{doubled}"
            starting = asyncio.create_task(rig.robot.jogs.start(1, "Z", "-"))
            await rig.cable.written_from("JOG")
            if mode == 3:  # in Ver.2 the first copy has no answer
                rig.fail(Fault.LOST, Direction.REPLIES, 1)
            with pytest.raises(NoReply, match="is being stopped"):
                await starting
            await rig.robot.jogs.settled()
            assert rig.fics.job is None
            assert rig.types("robot.jog") == ENDED

    story()


@in_virtual_time
async def test_an_axis_that_was_stopped_before_it_could_be_asked_may_have_jogged() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        doubled = StartJog(axis="Z", direction="-").text
        rig.cable.damaged[doubled] = f"{doubled}\r{doubled}"
        starting = asyncio.create_task(rig.robot.jogs.start(1, "Z", "-"))
        await rig.cable.written_from("JOG")
        rig.fail(Fault.LOST, Direction.REPLIES, 1)
        rig.cable.lost_answer = "ACD"
        await rig.cable.written_from("ACD")
        stopping = rig.robot.stop("immediate")
        await rig.cable.written_from("AES")
        rig.cable.lost_answer = ""
        with pytest.raises(NoReply, match="is being stopped"):
            await starting
        assert (await stopping).state == "confirmed"
        assert rig.fics.job is None


@pytest.mark.parametrize("mode", [2, 3])
def test_without_a_heartbeat_the_axis_is_stopped(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await rig.move(HomeRobot())
            session = await rig.robot.jogs.start(1, "Z", "-")
            await asyncio.sleep(0.49)
            assert rig.fics.job is not None
            sent = len(rig.cable.written)
            await asyncio.sleep(1.5)
            assert rig.cable.frames(sent)[0] == "JOG Z"
            assert rig.fics.job is None
            assert rig.types("robot.jog") == LOST
            with pytest.raises(JogOver, match="lost"):
                rig.robot.jogs.heartbeat(session.id)
            assert not rig.robot.moving

    story()


@in_virtual_time
async def test_an_axis_that_does_not_hear_its_end_is_stopped_with_the_robot() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        await rig.robot.jogs.start(1, "Z", "-")
        await asyncio.sleep(0.4)
        rig.fail(Fault.LOST, Direction.REQUESTS, 3)
        await asyncio.sleep(10)
        assert rig.fics.job is None
        assert not rig.robot.moving


@in_virtual_time
async def test_a_stop_of_the_robot_ends_the_session() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        session = await rig.robot.jogs.start(1, "Z", "-")
        assert (await rig.robot.stop("decelerate")).state == "confirmed"
        with pytest.raises(JogOver, match="stopped"):
            rig.robot.jogs.heartbeat(session.id)
        assert not rig.robot.moving


@in_virtual_time
async def test_motor_axes_jog_together_and_moves_wait() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        first = await rig.robot.jogs.start(1, "A", "-")
        second = await rig.robot.jogs.start(1, "B", "-")
        with pytest.raises(RobotBusy):
            await rig.move(HomeRobot())
        await rig.robot.jogs.end(first.id)
        assert rig.fics.job is not None
        await rig.robot.jogs.end(second.id)
        assert rig.fics.job is None


@pytest.mark.parametrize("mode", [2, 3])
def test_a_refused_jog_is_told_and_is_over(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            with pytest.raises(ControllerRefused):
                await rig.robot.jogs.start(1, "X", "+")  # converted, and not homed
            assert not rig.robot.moving
            assert rig.types("robot.jog") == ["robot.jog.started", "robot.jog.ended"]
            with pytest.raises(InvalidRequest, match="axis: r1/units/1 has the axes"):
                await rig.robot.jogs.start(1, "Q", "+")
            with pytest.raises(NotFound):
                rig.robot.jogs.heartbeat("unheard of")

    story()


@in_virtual_time
async def test_the_end_of_the_gateway_stops_what_jogs() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        await rig.robot.jogs.start(1, "Z", "-")
        await do_in_turn("the end of a robot", rig.robot.closing)
        assert rig.fics.job is None


async def keep_jogging(robot: Robot, session_id: str, seconds: float) -> None:
    for _ in range(round(seconds / 0.3)):
        await asyncio.sleep(0.3)
        robot.jogs.heartbeat(session_id)


@in_virtual_time
async def test_an_axis_waits_for_the_end_of_its_last_jog_which_never_stops_the_next() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        first = await rig.robot.jogs.start(1, "Z", "-")
        with pytest.raises(RobotBusy, match=r"axis Z .* nothing was sent"):
            await rig.robot.jogs.start(1, "Z", "+")
        await asyncio.sleep(0.505)
        assert (first.state, first.ends_as) == ("stopping", "lost")
        with pytest.raises(RobotBusy):
            await rig.robot.jogs.start(1, "Z", "-")
        await asyncio.sleep(0.2)
        second = await rig.robot.jogs.start(1, "Z", "-")
        sent = len(rig.cable.written)
        await keep_jogging(rig.robot, second.id, 1.8)
        assert "JOG Z" not in rig.cable.frames(sent)
        assert rig.fics.job is not None


@in_virtual_time
async def test_of_two_starts_of_one_axis_at_once_only_one_is_sent() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        starts = (rig.robot.jogs.start(1, "Z", "-"), rig.robot.jogs.start(1, "Z", "+"))
        first, second = await asyncio.gather(*starts, return_exceptions=True)
        assert isinstance(second, RobotBusy)
        assert not isinstance(first, BaseException)
        assert rig.heard("JOG") == ["JOG Z-"]


@in_virtual_time
async def test_axes_that_share_motors_wait_for_one_another() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        await rig.move(MoveRelative(coordinates=[-20.0, 5.0, None]))
        session = await rig.robot.jogs.start(1, "X", "-")
        with pytest.raises(RobotBusy, match="axis X"):
            await rig.robot.jogs.start(1, "A", "-")
        await rig.robot.jogs.end(session.id)
        assert (await rig.robot.jogs.start(1, "A", "-")).state == "jogging"


@in_virtual_time
async def test_the_robot_moves_until_the_last_of_its_axes_stands_still() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        first = await rig.robot.jogs.start(1, "A", "-")
        second = await rig.robot.jogs.start(1, "B", "-")
        ending = asyncio.create_task(rig.robot.jogs.end(first.id))
        await asyncio.sleep(0.09)
        rig.cable.lost_command = "JOG B"
        last = asyncio.create_task(rig.robot.jogs.end(second.id))
        await ending
        assert rig.fics.job is not None
        assert rig.robot.moving
        rig.cable.lost_command = ""
        await last
        assert rig.fics.job is None
        assert not rig.robot.moving


@pytest.mark.parametrize("mode", [2, 3])
def test_an_axis_that_has_come_to_its_limit_jogs_no_more(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await rig.move(HomeRobot())
            session = await rig.robot.jogs.start(1, "Z", "+")
            with pytest.raises(JogOver, match=r"\(ended\): it came to rest without a stop, as at a limit"):
                await keep_jogging(rig.robot, session.id, 120.0)
            assert rig.types("robot.jog") == ENDED
            await asyncio.sleep(0.5)
            assert not rig.robot.moving
            assert (await rig.move(HomeRobot())).status == "succeeded"

    story()


@in_virtual_time
async def test_a_jog_whose_answer_is_lost_ends_once() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        rig.cable.lost_answer = "JOG"
        with pytest.raises(NoReply):
            await rig.robot.jogs.start(1, "Z", "-")
        await asyncio.sleep(3)
        assert rig.fics.job is None
        assert rig.types("robot.jog") == LOST


@in_virtual_time
async def test_a_stop_that_comes_before_the_answer_is_the_last_news_of_the_jog() -> None:
    async with fics_rig(baud=9600) as rig:
        await rig.move(HomeRobot())
        starting = asyncio.create_task(rig.robot.jogs.start(1, "Z", "-"))
        await rig.cable.written_from("JOG")
        stopping = rig.robot.stop("immediate")
        with pytest.raises(JogOver, match="stopped"):
            await starting
        assert (await stopping).state == "confirmed"
        assert rig.types("robot.jog") == STOPPED


@in_virtual_time
async def test_after_a_stop_of_the_robot_the_end_of_a_jog_stops_nothing_more() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        session = await rig.robot.jogs.start(1, "Z", "-")
        ending = asyncio.create_task(rig.robot.jogs.end(session.id))
        await asyncio.sleep(0)
        assert (await rig.robot.stop("decelerate")).state == "confirmed"
        sent = len(rig.cable.written)
        assert (await rig.move(MoveRelative(coordinates=[None, None, -5.0]))).status == "succeeded"
        await ending
        assert not [text for text in rig.cable.frames(sent) if text.startswith(("JOG", "AES"))]


@in_virtual_time
async def test_a_stop_of_an_axis_ends_its_session() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        session = await rig.robot.jogs.start(1, "Z", "-")
        await rig.robot.jogs.stop(1, "Z")
        assert rig.fics.job is None
        assert session.state == "ended"
        assert not rig.robot.moving


@in_virtual_time
async def test_a_start_that_waits_does_not_follow_the_stop_of_its_axis() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        starting = asyncio.create_task(rig.robot.jogs.start(1, "Z", "-"))
        await asyncio.sleep(0)
        await rig.robot.jogs.stop(1, "Z")
        with pytest.raises(StoppedFirst):
            await starting
        assert "JOG Z-" not in rig.heard("JOG")
        assert rig.types("robot.jog") == []


@in_virtual_time
async def test_an_axis_without_a_session_is_stopped_where_its_unit_is_the_one_selected() -> None:
    async with fics_rig(units=2) as rig:
        await rig.move(HomeRobot())
        await rig.robot.unit(1).status()
        rig.touch(lambda fics, now: fics.execute("JOG", "Z-", now))  # for an earlier life of the gateway
        with pytest.raises(UnitNotSelected, match="Axis Z of unit 2 was not stopped"):
            await rig.robot.jogs.stop(2, "Z")
        assert rig.fics.job is not None
        await rig.robot.jogs.stop(1, "Z")
        assert rig.fics.job is None


@in_virtual_time
async def test_the_axis_of_an_only_unit_is_stopped_without_asking_for_the_unit() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        rig.touch(lambda fics, now: fics.execute("JOG", "Z-", now))
        rig.robot.known.unit.forget()
        await rig.robot.jogs.stop(1, "Z")
        assert rig.fics.job is None


@in_virtual_time
async def test_a_stop_that_leaves_its_axis_moving_says_so() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        move = asyncio.create_task(rig.move(MoveRelative(coordinates=[None, None, -80.0])))
        await rig.cable.written_from("LMI")
        await asyncio.sleep(0.05)
        rig.cable.lost_answer = "ACD"
        with pytest.raises(RobotBusy, match=r"JOG Z was sent .* not seen to stand still"):
            await rig.robot.jogs.stop(1, "Z")
        rig.cable.lost_answer = ""
        await move


@in_virtual_time
async def test_a_heartbeat_that_cannot_keep_the_axis_says_so_and_keeps_nothing() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        session = await rig.robot.jogs.start(1, "Z", "-")
        rig.cable.unplug()
        await asyncio.sleep(0.3)
        with pytest.raises(JogOutOfReach, match="axis Z of unit 1 may go on moving"):
            rig.robot.jogs.heartbeat(session.id)
        await asyncio.sleep(0.3)
        assert (session.state, session.ends_as) == ("stopping", "lost")


@in_virtual_time
async def test_reads_of_others_keep_nobody_from_seeing_that_a_jog_has_ended() -> None:
    async with fics_rig(baud=4800) as rig:
        await rig.move(HomeRobot())
        numbers = itertools.cycle(range(100))

        async def poll() -> None:
            while True:
                await rig.robot.read(GetVariable(number=next(numbers)))

        others = [asyncio.create_task(poll()) for _ in range(60)]
        await asyncio.sleep(1)
        session = await rig.robot.jogs.start(1, "Z", "-")
        assert (await rig.robot.jogs.end(session.id)).state == "ended"
        assert rig.heard("AES") == []
        for other in others:
            other.cancel()
        await asyncio.gather(*others, return_exceptions=True)


# what an axis is said to do is true


def moves(rig: FicsRig) -> bool:
    """Say whether Z of unit 1 moves, by the simulator's truth."""
    rig.touch(lambda _fics, _now: None)
    return rig.fics.units[1].moves(2)


@asynccontextmanager
async def jogging_that_brakes_slowly(mode: int) -> AsyncIterator[tuple[FicsRig, JogSession]]:
    """Jog Z fast, with a brake that takes seconds, and judge every event about it by the truth."""
    async with fics_rig(mode=mode) as rig:
        rig.fics.units[1].users[2].minus_limit = -10_000.0
        rig.fics.units[1].motors[2].world = replace(rig.fics.units[1].motors[2].world, minus_limit=-20_000.0)
        await rig.move(HomeRobot())
        for setting in SLOW_TO_STOP:
            await rig.robot.ask(setting, 1)
        lies = []
        publish = rig.robot._publish

        def judged(kind: str, subject: str, data: Data, correlation: str | None) -> Event:
            if kind in ("robot.jog.ended", "robot.jog.lost", "robot.jog.stopped") and moves(rig):
                lies.append(kind)
            return publish(kind, subject, data, correlation)

        rig.robot._publish = judged
        session = await rig.robot.jogs.start(1, "Z", "-")
        for _ in range(8):
            await asyncio.sleep(0.3)
            rig.robot.jogs.heartbeat(session.id)
        yield rig, session
        await asyncio.sleep(15)
        assert lies == []
        assert not moves(rig)
        assert session.state == session.ends_as


@pytest.mark.parametrize("mode", [2, 3])
def test_a_jog_is_not_over_while_its_axis_moves(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with jogging_that_brakes_slowly(mode) as (rig, session):
            ending = asyncio.create_task(rig.robot.jogs.end(session.id))
            await asyncio.sleep(0.5)
            assert moves(rig)
            assert session.state == "stopping"
            with pytest.raises(JogOver, match=r"is being stopped \(ended\); the axis may still move"):
                rig.robot.jogs.heartbeat(session.id)
            assert (await ending).state == ("stopping" if moves(rig) else "ended")
        with pytest.raises(JogOver, match=r"is over \(ended\); the axis stands still"):
            rig.robot.jogs.heartbeat(session.id)

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_a_jog_that_is_stopped_with_the_robot_is_over_when_that_stands_still(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with jogging_that_brakes_slowly(mode) as (rig, session):
            report = await rig.robot.stop("decelerate")
            assert (report.state == "confirmed") is not moves(rig)
            assert session.state == ("stopping" if moves(rig) else "stopped")
            assert (await rig.robot.jogs.end(session.id)).state == ("stopping" if moves(rig) else "stopped")
        assert session.state == "stopped"
        assert rig.types("robot.jog") == STOPPED

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_a_jog_without_heartbeat_is_lost_when_its_axis_stands_still(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with jogging_that_brakes_slowly(mode) as (rig, session):
            await asyncio.sleep(0.7)
            assert moves(rig)
            assert (session.state, session.ends_as) == ("stopping", "lost")
            assert (await rig.robot.jogs.end(session.id)).state == ("stopping" if moves(rig) else "lost")

    story()


@in_virtual_time
async def test_an_end_that_nobody_could_see_says_so() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        session = await rig.robot.jogs.start(1, "Z", "-")
        rig.cable.lost_answer = "ACD"
        assert (await rig.robot.jogs.end(session.id)).state == "stopping"
        assert rig.types("robot.jog")[-1] == "robot.jog.not_stopped"
        rig.cable.lost_answer = ""
        await asyncio.sleep(5)
        assert (await rig.robot.jogs.end(session.id)).state == "ended"


@in_virtual_time
async def test_the_stop_of_an_axis_whose_session_was_not_seen_to_end_says_so() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        await rig.robot.jogs.start(1, "Z", "-")
        rig.cable.lost_answer = "ACD"
        with pytest.raises(RobotBusy, match=r"JOG Z was sent .* not seen to stand still"):
            await rig.robot.jogs.stop(1, "Z")


@pytest.mark.parametrize("mode", [2, 3])
def test_an_axis_on_its_ramp_does_not_make_the_whole_robot_stop(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with jogging_that_brakes_slowly(mode) as (rig, session):
            assert (await rig.robot.jogs.end(session.id)).state == "ended"
            assert rig.types("robot.jog") == ENDED
            assert rig.types("robot.stop") == []

    story()
