"""What happens to a robot without us is noticed and told."""

import asyncio

import pytest

from gateway.fics.errors import RobotRefused
from gateway.fics.watch import HEALTH_POLL_S
from protocols.fics.moves import MoveRelative
from simulator.fics.alarms import system_error
from tests.fics_plants import SET_UP_S, fics_rig
from tests.plants import in_virtual_time


@in_virtual_time
async def test_motion_nobody_here_asked_for_is_told() -> None:
    async with fics_rig() as rig:
        await rig.robot.unit(1).status()
        await asyncio.sleep(HEALTH_POLL_S - SET_UP_S - 0.5)
        rig.touch(lambda fics, now: fics.execute("ORG", "", now))
        await asyncio.sleep(1)
        assert rig.types("robot.motion") == ["robot.motion.foreign"]
        assert rig.robot.moving
        with pytest.raises(RobotRefused) as refused:
            await rig.move(MoveRelative(coordinates=[None, None, 1.0]))
        assert refused.value.fics_error == "E01"


@in_virtual_time
async def test_an_error_that_came_by_itself_is_found() -> None:
    async with fics_rig() as rig:
        rig.fics.units[1].motors[0].driver_error = 0x41
        rig.touch(lambda fics, now: fics.raise_alarm(system_error(183, 1, 2), now))
        await asyncio.sleep(2 * HEALTH_POLL_S)
        assert rig.robot.latched_error is not None
        assert rig.types("robot.error") == ["robot.error"]


@in_virtual_time
async def test_what_cannot_be_read_is_told() -> None:
    async with fics_rig() as rig:
        rig.cable.lost_answer = "ACD"
        await asyncio.sleep(3 * HEALTH_POLL_S)
        assert "robot.unreadable" in rig.types("robot")
