"""A motion command: what is proved before it is written, and what its end leaves."""

import asyncio

import pytest

from gateway.core.errors import Expired, StoppedFirst
from gateway.core.exchange import Lane
from gateway.fics.conversation import Accepted
from gateway.fics.errors import ErrorStands, RobotBusy
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveRelative
from protocols.fics.row import FicsCommand
from protocols.table import Ack
from simulator.fics.alarms import driver_error
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time

DOWN = MoveRelative(coordinates=[None, None, -5.0])


async def begin(rig: FicsRig, command: FicsCommand[Ack], within_s: float = 5.0) -> Accepted:
    motions = rig.robot.conversation
    return await motions.begin(
        command,
        rig.robot.unit(1),
        epoch=rig.robot.line.stop_epoch,
        expires_at=asyncio.get_running_loop().time() + within_s,
        on_written=lambda _: None,
    )


@in_virtual_time
async def test_the_unit_and_the_mode_are_asked_for_right_before_a_motion() -> None:
    async with fics_rig(units=2) as rig:
        sent = len(rig.cable.written)
        accepted = await begin(rig, HomeRobot())
        assert rig.cable.frames(sent)[-3:] == ["UNT", "MOD", "ORG"]
        assert rig.robot.known.motion.command == HomeRobot()
        await accepted.outcome
        rig.robot.conversation.end(accepted)
        assert rig.robot.known.motion.command is None


@in_virtual_time
async def test_a_motion_that_waits_too_long_or_is_stopped_first_is_not_written() -> None:
    async with fics_rig() as rig:
        sent = len(rig.cable.written)
        async with rig.robot.line.sequence_lock.held(Lane.STOP):
            with pytest.raises(Expired):
                await begin(rig, HomeRobot(), within_s=0.5)
            waiting = asyncio.create_task(begin(rig, HomeRobot()))
            await asyncio.sleep(0.1)
            rig.robot.line.begin_stop()
        with pytest.raises(StoppedFirst):
            await waiting
        assert "ORG" not in rig.cable.frames(sent)


@in_virtual_time
async def test_an_error_that_stands_and_a_motion_under_way_forbid_the_next() -> None:
    async with fics_rig() as rig:
        accepted = await begin(rig, HomeRobot())
        with pytest.raises(RobotBusy, match="ORG of r1 is under way; LMI was not sent"):
            rig.robot.known.require_fit(DOWN)
        await accepted.outcome
        rig.robot.conversation.end(accepted)
        rig.touch(lambda fics, now: fics.raise_alarm(driver_error(1, "A", 3), now))
        await rig.robot.conversation.poll_error()
        with pytest.raises(ErrorStands, match="LMI was not sent"):
            rig.robot.known.require_fit(DOWN)


@in_virtual_time
async def test_a_motion_that_ends_without_its_answer_is_fenced() -> None:
    async with fics_rig() as rig:
        accepted = await begin(rig, HomeRobot())
        fences = rig.robot.line.counters["fences"]
        rig.robot.conversation.end(accepted)
        await rig.robot.unit(1).status()
        assert rig.robot.line.counters["fences"] == fences + 1
