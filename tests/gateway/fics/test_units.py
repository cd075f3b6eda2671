"""A unit: why it does not tell where its axes stand."""

import asyncio
from itertools import permutations

import pytest

from gateway.fics.watch import HEALTH_POLL_S
from protocols.fics.homing import HomeRobot
from protocols.fics.macros import RunMacro
from protocols.fics.status import STATUS_BITS, MotionMode
from simulator.fics.alarms import connection_lost
from simulator.fics.settings import RobotSettings
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time


async def reasons(rig: FicsRig, unit: int = 1) -> dict[str, str]:
    it = rig.robot.unit(unit)
    return dict(await it.why_unknown(await it.position()))


@in_virtual_time
async def test_h11_positions_that_are_not_told_have_a_reason() -> None:
    async with fics_rig(units=2) as rig:
        assert await reasons(rig) == dict.fromkeys("XYZ", "not_homed")
        homing = await rig.start(HomeRobot())
        assert await reasons(rig) == dict.fromkeys("XYZ", "homing")
        await rig.plant.robot_moves.wait(homing.id, 60)
        assert await reasons(rig) == {}
        macro = await rig.start(RunMacro(macro="PCK", arguments=[150.0, 140.0, -5.0]))
        assert await reasons(rig) == dict.fromkeys("XYZ", "macro")
        await rig.plant.robot_moves.wait(macro.id, 60)
        rig.touch(lambda fics, _: setattr(fics, "terminal", MotionMode.MACRO))
        assert await reasons(rig) == dict.fromkeys("XYZ", "automatic")
        rig.touch(lambda fics, _: setattr(fics, "terminal", None))
        assert await reasons(rig) == {}


@in_virtual_time
async def test_h11_each_axis_has_its_own_reason() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        rig.fics.units[1].motors[1].homed = False
        assert await reasons(rig) == {"X": "not_homed", "Y": "not_homed"}
        rig.fics.units[1].motors[1].homed = True
        rig.fics.units[1].motors[2].silent = True
        rig.touch(lambda fics, now: fics.raise_alarm(connection_lost(0, "Z"), now))
        await rig.robot.conversation.poll_error()
        assert await reasons(rig) == {"Z": "not_known"}


@pytest.mark.parametrize("order", list(permutations(STATUS_BITS)), ids=" ".join)
def test_h11_an_axis_is_told_as_not_homed_whatever_the_bit_for_that_means(order: tuple[str, ...]) -> None:
    @in_virtual_time
    async def story() -> None:
        settings = RobotSettings(status_bits=order, origin_bit="lasting")
        async with fics_rig(prepare=lambda machine: setattr(machine.robot, "settings", settings)) as rig:
            assert await reasons(rig) == dict.fromkeys("XYZ", "not_homed")
            await rig.move(HomeRobot())
            rig.power_cycle()
            await asyncio.sleep(HEALTH_POLL_S)
            assert await reasons(rig) == dict.fromkeys("XYZ", "not_homed")

    story()
