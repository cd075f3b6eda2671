"""Robots that do otherwise than is assumed, where the manual leaves it open: they are served all the same."""

import asyncio
from itertools import permutations

import pytest

from gateway.core.errors import NotSent
from gateway.core.move_record import MoveStatus
from protocols.fics.alarms import ResetErrors
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveAbsolute, MoveRelative
from protocols.fics.speeds import SetDecelerationTimes
from protocols.fics.status import SENSOR_BITS, STATUS_BITS
from simulator.fics.settings import RobotSettings
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time

OTHERS = {
    "AES is refused while ASS brakes": RobotSettings(stop_while_braking="refused"),
    "AES brakes": RobotSettings(emergency_stop="brakes"),
    "the origin bit outlasts the power": RobotSettings(origin_bit="lasting"),
    "a single unit hides its positions too": RobotSettings(hidden_positions="always"),
    "the old mode answers MOD": RobotSettings(mode_change="old_mode"),
}


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize("other", OTHERS)
def test_it_moves_stops_and_goes_nowhere_after_a_loss_of_power(other: str, mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(
            mode=mode, prepare=lambda machine: setattr(machine.robot, "settings", OTHERS[other])
        ) as rig:
            await asyncio.sleep(2)
            assert (await rig.move(HomeRobot())).status is MoveStatus.SUCCEEDED
            to_5 = MoveAbsolute(coordinates=[None, None, 5.0])
            assert (await rig.move(to_5)).status is MoveStatus.SUCCEEDED
            assert (await rig.robot.stop("immediate")).state == "confirmed"
            await rig.robot.ask(ResetErrors())
            rig.power_cycle()
            await asyncio.sleep(5)
            with pytest.raises(NotSent):
                await rig.move(to_5)

    story()


ORDERS = {" ".join(order): RobotSettings(status_bits=order) for order in permutations(STATUS_BITS)} | {
    " ".join(order): RobotSettings(sensor_bits=order) for order in permutations(SENSOR_BITS)
}


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize("order", ORDERS)
def test_whatever_the_bits_of_acd_and_asd_mean_moves_end_and_stops_are_confirmed(
    order: str, mode: int
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(
            mode=mode, prepare=lambda machine: setattr(machine.robot, "settings", ORDERS[order])
        ) as rig:
            await asyncio.sleep(2)
            assert (await rig.move(HomeRobot())).status is MoveStatus.SUCCEEDED
            to_5 = MoveAbsolute(coordinates=[None, None, 5.0])
            assert (await rig.move(to_5)).status is MoveStatus.SUCCEEDED
            jog = await rig.robot.jogs.start(1, "Z", "+")
            assert (await rig.robot.jogs.end(jog.id)).state == "ended"
            assert rig.types("robot.jog.not_stopped") == []
            down = await rig.start(MoveAbsolute(coordinates=[None, None, -5.0]))
            await asyncio.sleep(0.05)
            assert (await rig.robot.stop("decelerate")).state == "confirmed"
            assert (await rig.plant.robot_moves.wait(down.id, 60)).status is MoveStatus.STOPPED
            homing = await rig.start(HomeRobot())
            await asyncio.sleep(0.05)
            assert (await rig.robot.stop("immediate")).state == "confirmed"
            assert (await rig.plant.robot_moves.wait(homing.id, 60)).status is MoveStatus.STOPPED
            assert not rig.robot.power_cycled

    story()


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize("order", list(permutations(STATUS_BITS)), ids=" ".join)
def test_axes_that_brake_in_an_emergency_stop_are_not_called_still(order: tuple[str, ...], mode: int) -> None:
    """The first digit of ACD is 5 at once, and the second may mean anything (C-HOST manual 2-10)."""

    @in_virtual_time
    async def story() -> None:
        settings = RobotSettings(emergency_stop="brakes", status_bits=order)
        async with fics_rig(
            mode=mode, prepare=lambda machine: setattr(machine.robot, "settings", settings)
        ) as rig:
            await rig.move(HomeRobot())
            await rig.robot.ask(SetDecelerationTimes(times_ms=[None, None, 4000]), 1)
            await rig.start(MoveAbsolute(coordinates=[None, None, -90.0]))
            await asyncio.sleep(0.5)
            stopped_at = asyncio.get_running_loop().time()
            stop = rig.robot.stop("immediate")
            while rig.fics.job is not None:
                assert rig.types("robot.stop.confirmed") == []
                await asyncio.sleep(0.1)
            (braked,) = [fact for fact in rig.stops() if fact.facts["why"] == "alarm"]
            assert braked.at > stopped_at + 1
            assert (await stop).state == "confirmed"

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_an_immediate_stop_that_is_refused_while_the_robot_brakes_is_told_as_refused(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        settings = RobotSettings(stop_while_braking="refused")
        async with fics_rig(
            mode=mode, prepare=lambda machine: setattr(machine.robot, "settings", settings)
        ) as rig:
            await rig.start(MoveRelative(coordinates=[None, None, -50.0]))
            await asyncio.sleep(0.3)
            decelerate = rig.robot.stop("decelerate")
            await asyncio.sleep(0.01)
            immediate = rig.robot.stop("immediate")
            assert (await immediate).state == "confirmed"
            assert (await decelerate).state == "confirmed"
            (refused,) = rig.events("robot.stop.refused")
            assert (refused.data["state"], refused.data["error"]) == ("refused", "E04")

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_an_immediate_stop_whose_repetition_is_refused_is_told_as_refused_too(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        settings = RobotSettings(stop_while_braking="refused")
        async with fics_rig(
            mode=mode, prepare=lambda machine: setattr(machine.robot, "settings", settings)
        ) as rig:
            await rig.robot.ask(SetDecelerationTimes(times_ms=[None, None, 8000]), 1)
            await rig.start(MoveRelative(coordinates=[None, None, -90.0]))
            await asyncio.sleep(0.5)
            decelerate = rig.robot.stop("decelerate")
            await asyncio.sleep(0.01)
            rig.cable.lost_once = "AES"
            await asyncio.gather(decelerate, rig.robot.stop("immediate"))
            (refused,) = rig.events("robot.stop.refused")
            assert (refused.data["state"], refused.data["error"]) == ("refused", "E04")

    story()


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize("order", list(permutations(STATUS_BITS)), ids=" ".join)
def test_an_unhomed_axis_that_brakes_beside_another_jog_is_not_called_still(
    order: tuple[str, ...], mode: int
) -> None:
    @in_virtual_time
    async def story() -> None:
        settings = RobotSettings(status_bits=order)
        async with fics_rig(
            units=2, mode=mode, prepare=lambda machine: setattr(machine.robot, "settings", settings)
        ) as rig:
            await rig.robot.ask(SetDecelerationTimes(times_ms=[4000]), 2)
            braking = await rig.robot.jogs.start(2, "X", "+")
            await rig.robot.jogs.start(2, "Y", "+")
            await asyncio.sleep(0.3)
            ended = await rig.robot.jogs.end(braking.id)
            assert ended.state == "stopping" or not rig.fics.units[2].moves(0)

    story()
