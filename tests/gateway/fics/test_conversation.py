"""Questions to a robot: of the right unit, and once for all who ask the same."""

import asyncio
import itertools

import pytest

from gateway.core.errors import Expired, NoReply
from gateway.core.exchange import Lane
from gateway.fics.conversation import TURN_WITHIN_S
from gateway.fics.knowledge import UNIT_HOLDS_S
from gateway.fics.watch import HEALTH_POLL_S
from protocols.fics.alarms import TakeCurrentError
from protocols.fics.inputs_outputs import SwitchOutput
from protocols.fics.jog import StopJog
from protocols.fics.motor_axes import GetMotorPosition
from protocols.fics.speeds import GetMaximumSpeeds, SetMaximumSpeeds
from protocols.fics.status import MotionMode
from protocols.fics.variables import GetVariable
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time

COPIES_PAST_S = 2.1
"""Seconds after which no copy of an answer comes any more."""


@in_virtual_time
async def test_a_unit_is_verified_once_for_all_questions_of_a_second() -> None:
    async with fics_rig(units=2) as rig:
        await rig.robot.unit(2).position()
        sent = len(rig.cable.written)
        await rig.robot.unit(2).position("motor")
        await rig.robot.unit(2).status()
        assert rig.cable.frames(sent) == ["MPS", "ACD"]


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
        assert rig.robot.line.waiting()["read"] == 1
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
async def test_what_is_asked_of_a_unit_is_never_answered_by_another() -> None:
    async with fics_rig(units=2) as rig:
        await rig.robot.ask(SetMaximumSpeeds(speeds=[11.0]), 2)
        await asyncio.sleep(UNIT_HOLDS_S)
        rig.fics.host_unit = 1  # as after a loss of power
        assert (await rig.robot.read(GetMaximumSpeeds(), 2)).speeds[0] == 11.0
        (changed,) = rig.events("robot.unit.changed")
        assert changed.data == {"expected": 2, "found": 1}


@in_virtual_time
async def test_an_only_unit_is_not_asked_for() -> None:
    async with fics_rig() as rig:
        await asyncio.sleep(10)
        sent = len(rig.cable.written)
        await rig.robot.unit(1).position()
        assert rig.cable.frames(sent) == ["APS"]


@in_virtual_time
async def test_a_unit_whose_number_nobody_knows_is_asked_for_before_it_is_changed() -> None:
    async with fics_rig(units=2) as rig:
        rig.robot.known.unit.forget()
        await asyncio.sleep(COPIES_PAST_S)
        sent = len(rig.cable.written)
        await rig.robot.unit(1).position()
        assert rig.cable.frames(sent) == ["UNT", "APS"]


@in_virtual_time
async def test_while_the_terminal_runs_the_unit_that_was_told_before_is_read() -> None:
    async with fics_rig(units=2) as rig:
        await rig.robot.unit(2).status()
        await asyncio.sleep(UNIT_HOLDS_S)
        rig.touch(lambda fics, _: setattr(fics, "terminal", MotionMode.MACRO))
        axes = await rig.robot.unit(2).status()
        assert {axis.motion_mode for axis in axes.values()} == {MotionMode.MACRO}


@pytest.mark.parametrize("mode", [2, 3])
def test_while_the_terminal_runs_nobody_is_kept_by_questions_for_the_unit(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode, units=2) as rig:
            await rig.robot.unit(2).status()
            await asyncio.sleep(COPIES_PAST_S)
            rig.touch(lambda fics, _: setattr(fics, "terminal", MotionMode.MACRO))
            await rig.robot.unit(2).status()  # mode 2 refuses by silence: it takes seconds to find out
            assert rig.robot.moving
            sent = len(rig.cable.written)
            for _ in range(3):
                await asyncio.sleep(UNIT_HOLDS_S)
                await rig.robot.unit(2).status()
            frames = rig.cable.frames(sent)
            assert frames.count("ACD") >= 3  # and those of the watch
            assert [text for text in frames if text.startswith("UNT")] == []
            rig.touch(lambda fics, _: setattr(fics, "terminal", None))
            await asyncio.sleep(2 * HEALTH_POLL_S)
            assert rig.robot.moving is False
            assert rig.types("robot.motion") == ["robot.motion.foreign"]
            await asyncio.sleep(COPIES_PAST_S)
            sent = len(rig.cable.written)
            await rig.robot.unit(2).status()
            assert [text for text in rig.cable.frames(sent) if text[:3] != "VAR"] == ["UNT", "ACD"]

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_while_the_terminal_edits_the_unit_that_was_told_before_is_read(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode, units=2) as rig:
            await rig.robot.unit(2).status()
            rig.edit(on=True)
            await asyncio.sleep(UNIT_HOLDS_S)
            await rig.robot.unit(2).status()
            assert rig.robot.moving is False

    story()


@in_virtual_time
async def test_answers_are_told_with_the_moment_they_came() -> None:
    async with fics_rig(baud=9600) as rig:
        loop, unit = asyncio.get_running_loop(), rig.robot.unit(1)
        asked_at = loop.time()
        first = asyncio.create_task(rig.robot.conversation.ask(GetMotorPosition(), 1))
        second = asyncio.create_task(rig.robot.conversation.ask(GetMotorPosition(), 1))
        told = await first
        assert asked_at < told.at <= loop.time()
        assert await second == told
        await asyncio.sleep(1)
        assert told.at < (await unit.position_at("motor"))[1] <= loop.time()


SWITCH = SwitchOutput(channel=1, bit=0, on=True)


@in_virtual_time
async def test_reads_and_commands_wait_for_a_robot_that_is_busy_but_not_for_ever() -> None:
    async with fics_rig() as rig:
        loop, robot = asyncio.get_running_loop(), rig.robot
        async with robot.line.sequence_lock.held(Lane.STOP):
            sent, began = len(rig.cable.written), loop.time()
            asking = [
                robot.unit(1).position(),
                robot.positions(),
                robot.ask(SWITCH),
                robot.ask(TakeCurrentError()),
                robot.upload_positions([(1, [1.0])]),
            ]
            outcomes = await asyncio.gather(*asking, return_exceptions=True)
            assert {type(outcome) for outcome in outcomes} == {Expired}
            assert loop.time() == began + TURN_WITHIN_S
            assert rig.cable.frames(sent) == []
        await asyncio.sleep(10)
        assert rig.heard("IOT") == []
        assert not any(robot.line.waiting().values())


@in_virtual_time
async def test_what_waits_for_the_line_is_sent_in_time_or_not_at_all() -> None:
    async with fics_rig(baud=9600) as rig:
        line = rig.robot.line

        async def stop_again_and_again() -> None:
            for axis in itertools.cycle("XYZ"):
                line.submit(line.exchange(StopJog(axis=axis), Lane.STOP))
                await asyncio.sleep(0.003)

        stopping = asyncio.create_task(stop_again_and_again())
        asking = [rig.robot.unit(1).position(), rig.robot.ask(SWITCH)]
        outcomes = await asyncio.gather(*asking, return_exceptions=True)
        stopping.cancel()
        assert {type(outcome) for outcome in outcomes} == {Expired}
        await asyncio.sleep(2 * TURN_WITHIN_S)
        assert rig.heard("IOT") == []


@in_virtual_time
async def test_who_shares_a_question_does_not_hear_of_the_deadline_of_another() -> None:
    async with fics_rig() as rig:
        unit = rig.robot.unit(1)
        async with rig.robot.line.sequence_lock.held(Lane.STOP):
            early = asyncio.create_task(unit.position())
            await asyncio.sleep(TURN_WITHIN_S - 1)
            late = asyncio.create_task(unit.position())
            await asyncio.sleep(2)
            assert isinstance(early.exception(), Expired)
        assert await late == {"X": None, "Y": None, "Z": None}


@in_virtual_time
async def test_what_proves_the_end_of_a_move_or_a_stop_is_never_too_late() -> None:
    async with fics_rig() as rig:
        unit = rig.robot.unit(1)
        async with rig.robot.line.sequence_lock.held(Lane.STOP):
            asking = [asyncio.create_task(unit.status(lane)) for lane in (Lane.STOP, Lane.VERIFY)]
            await asyncio.sleep(10 * TURN_WITHIN_S)
        assert all(await asyncio.gather(*asking))
