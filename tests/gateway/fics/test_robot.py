"""A robot and its units: asking, settings, positions, errors."""

import asyncio

import pytest

from gateway.errors import InvalidRequest, NoReply, NotFound
from gateway.fics.errors import RobotRefused
from protocols.fics.axis_settings import SpeedPercents
from protocols.fics.homing import HomeRobot
from protocols.fics.jog import StartJog
from protocols.fics.link import Completion
from protocols.fics.moves import MoveRelative
from protocols.fics.speeds import GetSpeedPercent, SetSpeedPercent
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
            with pytest.raises(RobotRefused) as refused:
                await rig.robot.ask(SetSpeedPercent(percents=[10, 10, 10, 10]), 1)
            assert refused.value.command_code == "VAO"
            assert refused.value.fics_error in ("E05", "E06")
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
async def test_the_unit_is_verified_once_and_not_before_every_query() -> None:
    async with fics_rig(units=2) as rig:
        await rig.robot.unit(2).position()
        sent = len(rig.cable.written)
        await rig.robot.unit(2).position("motor")
        await rig.robot.unit(2).status()
        assert rig.cable.frames(sent) == ["MPS", "ACD"]


@in_virtual_time
async def test_what_needs_more_than_one_command_is_not_sent_alone() -> None:
    async with fics_rig() as rig:
        sent = len(rig.cable.written)
        for command in (StartJog(axis="X", direction="+"), HomeRobot()):
            with pytest.raises(InvalidRequest):
                await rig.robot.ask(command, 1)
        assert rig.cable.frames(sent) == []


@in_virtual_time
async def test_who_asks_the_same_while_it_waits_shares_the_answer() -> None:
    async with fics_rig(baud=9600) as rig:
        await rig.robot.unit(1).position()
        sent = len(rig.cable.written)
        unit = rig.robot.unit(1)
        first = asyncio.create_task(rig.robot.ask(GetVariable(number=1)))
        await asyncio.sleep(0.001)
        many = [asyncio.create_task(unit.position()) for _ in range(10)]
        await asyncio.sleep(0.001)
        assert rig.robot.line.waiting() == {"stop": 0, "command": 0, "read": 1}
        many[0].cancel()
        answers = await asyncio.gather(first, *many[1:])
        assert answers[1:] == [{"X": None, "Y": None, "Z": None}] * 9
        assert [text[:3] for text in rig.cable.frames(sent)] == ["VAR", "APS"]
        await unit.position()
        assert [text[:3] for text in rig.cable.frames(sent)] == ["VAR", "APS", "APS"]


@in_virtual_time
async def test_an_error_is_shared_as_well() -> None:
    async with fics_rig() as rig:
        rig.cable.lost_answer = "APS"
        asking = [asyncio.create_task(rig.robot.unit(1).position()) for _ in range(3)]
        outcomes = await asyncio.gather(*asking, return_exceptions=True)
        assert {type(outcome) for outcome in outcomes} == {NoReply}


@in_virtual_time
async def test_a_setting_asks_for_the_unit_again_before_it_is_sent() -> None:
    async with fics_rig(units=2) as rig:
        await rig.robot.unit(2).position()
        rig.fics.host_unit = 1  # behind our back
        await rig.robot.ask(SetSpeedPercent(percents=[7.0]), 2)
        assert [rig.fics.units[unit].users[0].percent for unit in (1, 2)] == [100.0, 7.0]
