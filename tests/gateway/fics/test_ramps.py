"""The time of a robot's ramp is asked while it rests: in motion it does not tell."""

import asyncio

import pytest

from protocols.fics.homing import HomeRobot
from protocols.fics.speeds import SetDecelerationTimes
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time


@pytest.mark.parametrize("mode", [2, 3])
def test_its_times_are_asked_once_and_learnt_from_every_setting(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await asyncio.sleep(30.0)
            assert [rig.cable.frames().count(it) for it in ("VSS", "MSS")] == [1, 1]
            ramps = rig.robot.known.motion.ramps
            assert ramps.longest_s == pytest.approx(2 * 0.2), "200 ms, and twice as long for S-curves"
            await rig.robot.ask(SetDecelerationTimes(times_ms=[100, 3000, 200]), 1)
            assert ramps.longest_s == pytest.approx(2 * 3.0)

    story()


@in_virtual_time
async def test_after_a_loss_of_power_they_are_asked_again() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        await asyncio.sleep(6.0)
        sent = len(rig.cable.written)
        rig.power_cycle()
        await asyncio.sleep(12.0)
        assert [rig.cable.frames(sent).count(it) for it in ("VSS", "MSS")] == [1, 1]


@in_virtual_time
async def test_a_robot_that_was_never_asked_has_no_ramp() -> None:
    async with fics_rig() as rig:
        rig.robot.known.motion.ramps.forget()
        assert rig.robot.known.motion.ramps.longest_s is None
        [unit] = rig.robot.units
        assert [it.code for it in rig.robot.known.motion.ramps.unknown_of(unit)] == ["VSS", "MSS"]
