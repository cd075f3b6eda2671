"""The teaching terminal runs the robot, state (a): a move is refused quickly (C-HOST manual 1-7)."""

import asyncio
from typing import Any

import pytest

from gateway.core.errors import ControllerRefused
from gateway.core.exchange import Lane
from gateway.core.jogs import START_WITHIN_S
from gateway.fics.session import QUICK_S
from gateway.fics.watch import HEALTH_POLL_S
from protocols.fics.moves import MoveRelative
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import GetAccelerationTimes, GetSpeedPercent
from protocols.fics.status import GetAxisStatus, MotionMode
from protocols.fics.variables import GetVariable
from simulator.faults import Direction, Fault
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time

DOWN = MoveRelative(coordinates=[None, None, -1.0])


@pytest.mark.parametrize(
    ("mode", "units", "first_s", "next_s"),
    [(2, 1, 0.6, 0.2), (2, 2, 1.7, 0.2), (3, 1, 0.01, 0.01), (3, 2, 0.01, 0.01)],
)
def test_a_move_is_refused_with_e01(mode: int, units: int, first_s: float, next_s: float) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode, units=units) as rig:
            rig.touch(lambda fics, _: setattr(fics, "terminal", MotionMode.MACRO))
            loop = asyncio.get_running_loop()
            for within_s in (first_s, next_s):
                asked_at = loop.time()
                with pytest.raises(ControllerRefused, match="LMI was not sent") as refused:
                    await rig.move(DOWN)
                assert loop.time() - asked_at < within_s
                assert (refused.value.command_code, refused.value.error_code) == ("LMI", "E01")
                await asyncio.sleep(7)
            rig.touch(lambda fics, _: setattr(fics, "terminal", None))
            await rig.move(DOWN)
            assert len(rig.heard("LMI")) == 1

    story()


@pytest.mark.parametrize("units", [1, 2])
def test_in_mode_2_a_move_is_refused_quickly_once_the_robot_was_seen_to_run(units: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=2, units=units) as rig:
            rig.touch(lambda fics, _: setattr(fics, "terminal", MotionMode.MACRO))
            await asyncio.sleep(HEALTH_POLL_S)
            asked_at = asyncio.get_running_loop().time()
            with pytest.raises(ControllerRefused, match="LMI was not sent"):
                await rig.move(DOWN)
            assert asyncio.get_running_loop().time() - asked_at < 2.5 * QUICK_S

    story()


@pytest.mark.parametrize(
    ("query", "first_s"),
    [(GetVariable(number=5), 0.6), (GetSpeedPercent(), 0.6), (GetAccelerationTimes(), 0.6)],
)
@in_virtual_time
async def test_a_question_that_is_refused_again_in_ver_2_is_refused_quickly(
    query: FicsCommand[Any], first_s: float
) -> None:
    async with fics_rig(mode=2) as rig:
        rig.touch(lambda fics, _: setattr(fics, "terminal", MotionMode.MACRO))
        for within_s in (first_s, 0.2):
            asked_at = asyncio.get_running_loop().time()
            with pytest.raises(ControllerRefused) as refused:
                await rig.robot.ask(query)
            assert refused.value.error_code == "E01"
            assert asyncio.get_running_loop().time() - asked_at < within_s


@in_virtual_time
async def test_an_answer_that_comes_after_the_quick_silence_counts() -> None:
    async with fics_rig(mode=2) as rig:
        rig.touch(lambda fics, _: setattr(fics, "terminal", MotionMode.MACRO))
        with pytest.raises(ControllerRefused):
            await rig.robot.ask(GetSpeedPercent())
        rig.touch(lambda fics, _: setattr(fics, "terminal", None))
        rig.fail(Fault.LATE, Direction.REPLIES, delay_s=2 * QUICK_S)
        assert (await rig.robot.read(GetSpeedPercent())).percents == [100.0, 100.0, 100.0]


@in_virtual_time
async def test_when_the_terminal_has_done_questions_have_their_time_again() -> None:
    async with fics_rig(mode=2) as rig:
        line = rig.robot.line
        rig.touch(lambda fics, _: setattr(fics, "terminal", MotionMode.MACRO))
        with pytest.raises(ControllerRefused):
            await rig.robot.ask(GetSpeedPercent())
        assert line.exchange(GetSpeedPercent(), Lane.READ).reply.timeout_s == QUICK_S
        assert line.exchange(GetAxisStatus(), Lane.READ).reply.timeout_s == line.reply_timeout_s
        rig.touch(lambda fics, _: setattr(fics, "terminal", None))
        await rig.robot.ask(GetSpeedPercent())
        assert line.exchange(GetSpeedPercent(), Lane.READ).reply.timeout_s == line.reply_timeout_s


@pytest.mark.parametrize("mode", [2, 3])
def test_a_jog_is_refused_with_e01(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            rig.touch(lambda fics, _: setattr(fics, "terminal", MotionMode.MACRO))
            asked_at = asyncio.get_running_loop().time()
            with pytest.raises(ControllerRefused) as refused:
                await rig.robot.jogs.start(1, "Z", "-")
            assert asyncio.get_running_loop().time() - asked_at < START_WITHIN_S
            assert (refused.value.command_code, refused.value.error_code) == ("JOG", "E01")

    story()
