"""Errors of the system: read by the gateway alone, kept, published and reset."""

import pytest

from gateway.fics.errors import ErrorStands, RobotFailed
from protocols.fics.moves import MoveRelative
from simulator.fics.alarms import system_error
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time

BOTH_MODES = pytest.mark.parametrize("mode", [2, 3])
DOWN = MoveRelative(coordinates=[None, None, -5.0])


@BOTH_MODES
def test_an_error_of_the_system_is_kept_published_and_reset(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            rig.touch(lambda fics, now: fics.raise_alarm(system_error(183, 12, 34), now))
            await rig.robot.look_for_errors()
            (record,) = await rig.robot.errors()
            assert (record.code, record.kind) == ("183", "fics")
            assert rig.types("robot.error") == ["robot.error"]
            with pytest.raises(ErrorStands):
                await rig.move(DOWN)
            await rig.robot.reset_errors()
            assert await rig.robot.errors() == []
            assert (await rig.move(DOWN)).status == "succeeded"

    story()


@in_virtual_time
async def test_an_error_whose_cause_is_there_stands_after_a_reset() -> None:
    async with fics_rig() as rig:
        rig.fics.stop_input = True
        await rig.robot.stop("immediate")
        with pytest.raises(RobotFailed):
            await rig.robot.reset_errors()
        assert len(await rig.robot.errors()) == 1


@in_virtual_time
async def test_errors_are_told_without_asking_the_robot() -> None:
    async with fics_rig() as rig:
        sent = len(rig.cable.written)
        assert await rig.robot.errors() == []
        assert rig.cable.frames(sent) == []
