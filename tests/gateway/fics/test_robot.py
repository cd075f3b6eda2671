"""A robot and its units: asking, settings, positions, errors."""

import asyncio

import pytest

from gateway.core.errors import ControllerRefused, InvalidRequest, NotFound
from gateway.core.line_state import LineState
from protocols.fics.axis_settings import SpeedPercents
from protocols.fics.homing import HomeRobot
from protocols.fics.jog import StartJog, StopJog
from protocols.fics.link import Completion
from protocols.fics.moves import MoveRelative
from protocols.fics.speeds import GetSpeedPercent, SetSpeedPercent
from protocols.fics.stops import StopAllDecelerating, StopAllImmediately
from protocols.fics.system import GetSystemVersion, SystemVersion
from protocols.fics.variables import GetVariable, SetVariable, VariableValue
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time

BOTH_MODES = pytest.mark.parametrize("mode", [2, 3])
DOWN = MoveRelative(coordinates=[None, None, -5.0])


@BOTH_MODES
def test_a_robot_answers_in_either_mode(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            assert rig.fics.mode == mode
            assert isinstance(await rig.robot.ask(GetSystemVersion()), SystemVersion)
            assert await rig.robot.ask(SetVariable(number=7, value=2.5)) == Completion("VAR")
            assert await rig.robot.ask(GetVariable(number=7)) == VariableValue(number=7, value=2.5)

    story()


@BOTH_MODES
def test_a_refusal_is_heard_in_either_mode(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            with pytest.raises(ControllerRefused) as refused:
                await rig.robot.ask(SetSpeedPercent(percents=[10, 10, 10, 10]), 1)
            assert refused.value.command_code == "VAO"
            assert refused.value.error_code in ("E05", "E06")
            assert refused.value.moved == "no"

    story()


@BOTH_MODES
def test_settings_reach_the_unit_they_are_meant_for(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode, units=2) as rig:
            await rig.robot.ask(SetSpeedPercent(percents=[10, 20, 30]), 2)
            await rig.robot.ask(SetSpeedPercent(percents=[40, 50, 60]), 1)
            assert await rig.robot.ask(GetSpeedPercent(), 2) == SpeedPercents(percents=[10, 20, 30])
            assert await rig.robot.ask(GetSpeedPercent(), 1) == SpeedPercents(percents=[40, 50, 60])
            with pytest.raises(InvalidRequest, match="acts on one unit"):
                await rig.robot.ask(GetSpeedPercent())
            with pytest.raises(NotFound, match="no unit 3"):
                await rig.robot.ask(GetSpeedPercent(), 3)

    story()


@in_virtual_time
async def test_what_needs_more_than_one_command_is_not_sent_alone() -> None:
    async with fics_rig() as rig:
        sent = len(rig.cable.written)
        for command in (StartJog(axis="X", direction="+"), HomeRobot()):
            with pytest.raises(InvalidRequest):
                await rig.robot.ask(command, 1)
        assert rig.cable.frames(sent) == []


@in_virtual_time
async def test_a_setting_asks_for_the_unit_again_before_it_is_sent() -> None:
    async with fics_rig(units=2) as rig:
        await rig.robot.unit(2).position()
        rig.fics.host_unit = 1  # behind our back
        await rig.robot.ask(SetSpeedPercent(percents=[7.0]), 2)
        assert [rig.fics.units[unit].users[0].percent for unit in (1, 2)] == [100.0, 7.0]


@in_virtual_time
async def test_a_stop_is_never_sent_as_a_mere_command() -> None:
    async with fics_rig() as rig:
        sent = len(rig.cable.written)
        for command in (StopAllImmediately(), StopAllDecelerating(), StopJog(axis="Z")):
            with pytest.raises(InvalidRequest):
                await rig.robot.ask(command, 1)
        assert rig.cable.frames(sent) == []


@in_virtual_time
async def test_whether_it_moves_is_told_only_by_who_has_looked() -> None:
    async with fics_rig() as rig:
        assert rig.robot.moving is False
        rig.cable.unplug()
        await asyncio.sleep(0)
        assert rig.robot.moving is None
        rig.cable.plugged_in = True
        await asyncio.sleep(4)
        assert rig.robot.line.state is LineState.READY
        assert rig.robot.moving is False


@in_virtual_time
async def test_a_robot_whose_move_was_lost_is_not_said_to_stand_still() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        await rig.robot.ask(SetSpeedPercent(percents=[None, None, 0.1]), 1)
        moving = asyncio.create_task(rig.move(MoveRelative(coordinates=[None, None, -50.0])))
        await rig.cable.written_from("LMI")
        rig.cable.lost_answer = "ACD"
        assert (await moving).status == "lost"
        assert rig.robot.moving is None
        rig.cable.lost_answer = ""
        await asyncio.sleep(6)
        assert rig.robot.moving is True
