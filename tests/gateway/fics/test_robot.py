"""A robot and its units: asking, settings, positions, errors."""

import pytest

from gateway.errors import InvalidRequest, NotFound
from gateway.fics.errors import ErrorStands, RobotFailed, RobotRefused
from protocols.fics.axis_settings import SpeedPercents
from protocols.fics.homing import HomeRobot
from protocols.fics.jog import StartJog
from protocols.fics.link import Completion
from protocols.fics.moves import MoveRelative
from protocols.fics.speeds import GetSpeedPercent, SetSpeedPercent
from protocols.fics.system import GetSystemVersion, SystemVersion
from protocols.fics.variables import GetVariable, SetVariable, VariableValue
from simulator.fics.alarms import system_error
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


@BOTH_MODES
def test_positions_are_stored_in_runs_and_read_again(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            sent = len(rig.cable.written)
            await rig.robot.upload_positions([(1, [1.0, 2.0, 3.0]), (7, [7.0, None, 7.5]), (2, [4.0])])
            spoken = [text for text in rig.cable.frames(sent) if text[:3] in ("POF", "POS")]
            assert spoken == ["POF 1,1", "POS 1,2,3", "POS 4", "POF 2", "POF 1,7", "POS 7,,7.5", "POF 2"]
            assert await rig.robot.positions(1, 5) == [(1, [1.0, 2.0, 3.0]), (2, [4.0])]
            assert await rig.robot.positions(7, 7) == [(7, [7.0, None, 7.5])]

    story()


@in_virtual_time
async def test_an_impossible_position_keeps_all_from_being_sent() -> None:
    async with fics_rig() as rig:
        sent = len(rig.cable.written)
        for positions in ([(0, [1.0])], [(1, [1.0]), (1, [2.0])], [(1, [None])], [(1, [1e12])]):
            with pytest.raises(InvalidRequest, match="nothing was sent"):
                await rig.robot.upload_positions(positions)
        assert rig.cable.frames(sent) == []


@BOTH_MODES
def test_an_upload_that_is_refused_is_ended_nevertheless(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            with pytest.raises(RobotRefused) as refused:
                await rig.robot.upload_positions([(1, [1.0, 2.0, 3.0, 4.0])])
            assert refused.value.fics_error == "E11"
            assert rig.fics.upload is None
            assert not rig.robot.line.uploading

    story()


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
