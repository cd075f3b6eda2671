"""Robots that do otherwise than is assumed, where the manual leaves it open: they are served all the same."""

import asyncio

import pytest

from gateway.core.errors import NotSent
from gateway.core.move_record import MoveStatus
from protocols.fics.alarms import ResetErrors
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveAbsolute
from simulator.fics.settings import RobotSettings
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time

OTHERS = {
    "AES is refused while ASS brakes": RobotSettings(stop_while_braking="refused"),
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
