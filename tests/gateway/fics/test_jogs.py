"""JOG goes on for as long as its heartbeat does, and no longer."""

import asyncio

import pytest

from gateway.errors import NotFound
from gateway.fics.errors import JogOver, RobotBusy, RobotRefused
from protocols.fics.homing import HomeRobot
from simulator.faults import Direction, Fault
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time


@pytest.mark.parametrize("mode", [2, 3])
def test_an_axis_jogs_while_the_heartbeat_lasts(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await rig.move(HomeRobot())
            session = await rig.robot.jog(1, "Z", "-")
            for _ in range(4):
                await asyncio.sleep(0.4)
                rig.robot.heartbeat(session.id)
            assert rig.fics.job is not None
            assert rig.robot.moving
            ended = await rig.robot.end_jog(session.id)
            assert ended.state == "ended"
            assert rig.fics.job is None
            assert not rig.robot.moving

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_without_a_heartbeat_the_axis_is_stopped(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await rig.move(HomeRobot())
            session = await rig.robot.jog(1, "Z", "-")
            await asyncio.sleep(0.49)
            assert rig.fics.job is not None
            sent = len(rig.cable.written)
            await asyncio.sleep(1.5)
            assert rig.cable.frames(sent)[0] == "JOG Z"
            assert rig.fics.job is None
            assert rig.types("robot.jog") == ["robot.jog.started", "robot.jog.lost"]
            with pytest.raises(JogOver, match="lost"):
                rig.robot.heartbeat(session.id)
            assert not rig.robot.moving

    story()


@in_virtual_time
async def test_an_axis_that_does_not_hear_its_end_is_stopped_with_the_robot() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        await rig.robot.jog(1, "Z", "-")
        await asyncio.sleep(0.4)
        rig.fail(Fault.LOST, Direction.REQUESTS, 3)
        await asyncio.sleep(10)
        assert rig.fics.job is None
        assert not rig.robot.moving


@in_virtual_time
async def test_a_stop_of_the_robot_ends_the_session() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        session = await rig.robot.jog(1, "Z", "-")
        assert (await rig.robot.stop("decelerate")).state == "confirmed"
        with pytest.raises(JogOver, match="stopped"):
            rig.robot.heartbeat(session.id)
        assert not rig.robot.moving


@in_virtual_time
async def test_motor_axes_jog_together_and_moves_wait() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        first = await rig.robot.jog(1, "A", "-")
        second = await rig.robot.jog(1, "B", "-")
        with pytest.raises(RobotBusy):
            await rig.move(HomeRobot())
        await rig.robot.end_jog(first.id)
        assert rig.fics.job is not None
        await rig.robot.end_jog(second.id)
        assert rig.fics.job is None


@pytest.mark.parametrize("mode", [2, 3])
def test_a_refused_jog_is_told_and_is_over(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            with pytest.raises(RobotRefused):
                await rig.robot.jog(1, "X", "+")  # converted, and not homed
            assert not rig.robot.moving
            with pytest.raises(NotFound, match="no axis Q"):
                await rig.robot.jog(1, "Q", "+")
            with pytest.raises(NotFound):
                rig.robot.heartbeat("unheard of")

    story()


@in_virtual_time
async def test_the_end_of_the_gateway_stops_what_jogs() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        await rig.robot.jog(1, "Z", "-")
        await rig.robot.close()
        assert rig.fics.job is None
