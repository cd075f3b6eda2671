"""Faults of the catalogue that have no better place."""

import asyncio
import re
from pathlib import Path

import pytest

from gateway.core.errors import ControllerRefused, GatewayError, NoReply
from gateway.core.journal import files, writes
from gateway.core.journal.disk import SqliteDisk
from gateway.core.journal.writes import DAY_S, Retention
from gateway.core.move_record import MoveStatus
from gateway.rorze.session import Answered
from protocols.fics.alarms import ResetErrors
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.notation import PositionReference
from protocols.rorze.origin import SetOverrunFactor
from protocols.rorze.position_table import SetPositionIndex
from protocols.rorze.stops import StopImmediately
from simulator.faults import Direction, Fault, Switch
from tests.fics_plants import fics_rig
from tests.gateway.rorze.far_end import FarEnd, running_line
from tests.gateway.rorze.test_line import MOVE, MOVE_FRAME, ask
from tests.plants import Rig, finished, in_virtual_time, rig, start
from tests.tested_plant import TestedPlant
from tests.world import World

A_WHILE_S = 5.0
STORM = 1_000
"""Events."""


@in_virtual_time
async def test_s11_a_bit_that_turns_a_body_into_another_moves_that_and_both_are_told() -> None:
    async with rig() as stand:
        write = stand.wire.write
        stand.wire.write = lambda data: write(data.replace(b"&001+M", b"&011+M"))  # type: ignore[method-assign]
        move = await finished(stand, MoveClockwise(distance=20_000), "00")
        await asyncio.sleep(A_WHILE_S)
        assert (move.status, move.end_cause) == (MoveStatus.FAILED, "not_executed")
        assert [event.subject for event in stand.events("body.motion.foreign")] == ["/bodies/line1.01"]
        assert [stand.axis(body).position(0.0) for body in (0x00, 0x01)] == [0, 20_000]


@in_virtual_time
async def test_l09_a_storm_of_events_delays_no_stop_and_disturbs_no_move() -> None:
    async with rig(baud=115_200) as stand:
        await start(stand, MoveClockwise(distance=200_000))
        moved = await start(stand, MoveClockwise(distance=2_000), "00")
        storm = asyncio.create_task(_storm(stand))
        await asyncio.sleep(1.0)
        asked_at = _now()
        [stopped] = await stand.plant.stops.stop([stand.body()], "immediate")
        [stop, *_] = [sent for sent in stand.wire.sent if sent.frame == "&3F5IS"]
        assert stop.at - asked_at < 61 * stand.wire.byte_time_s
        assert stopped.state == "confirmed"
        assert (await stand.plant.moves.wait(moved.id, 60.0)).status is MoveStatus.SUCCEEDED
        await storm
        assert len(stand.events("body.controller_event")) >= STORM


async def _storm(stand: Rig) -> None:
    """A body that reports a change of an input 500 times a second."""
    for number in range(STORM):
        stand.wire._deliver(f">&7EXED[01:I:H{number % 2:04X}]\r".encode())
        await asyncio.sleep(0.002)


@in_virtual_time
async def test_l12_a_reply_that_overtakes_another_is_credited_to_its_own_command() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.once(MOVE_FRAME, (0.05, ">&021+M"))
        far.once("&035IS")
        moving = ask(line, MOVE)
        await asyncio.sleep(0.001)
        stopping = ask(line, StopImmediately(), 3)
        far.say(">&035IS", 0.01)
        assert isinstance(await stopping, Answered)
        assert not moving.done()
        assert isinstance(await moving, Answered)
        assert far.frames[:2] == [MOVE_FRAME, "&035IS"]


@in_virtual_time
async def test_l12_a_reply_that_its_fence_has_overtaken_is_credited_to_nothing_and_told() -> None:
    async with rig() as stand:
        stand.machine.faults.set(Switch(Fault.LATE, Direction.REPLIES, next_frames=1, delay_s=1.0))
        with pytest.raises(NoReply):
            await stand.body().ask(SetOverrunFactor(factor=5))
        await asyncio.sleep(A_WHILE_S)
        [told] = stand.events("line.order.violated")
        assert told.subject == "/lines/line1"
        assert told.data["late"] == "set-overrun-factor of line1.3F"
        [alarm] = stand.plant.alarms.standing()
        assert (alarm.cause, alarm.subject) == ("line.order.violated", "/lines/line1")
        assert "the reply to set-overrun-factor of line1.3F came after that to" in alarm.en.happened


@in_virtual_time
async def test_l12_a_robot_whose_answers_come_out_of_order_is_told() -> None:
    async with fics_rig() as stand:
        stand.fail(Fault.LATE, Direction.REPLIES, delay_s=1.0)
        with pytest.raises(NoReply):
            await stand.robot.ask(ResetErrors())  # a setting is read back, and its name comes again
        await asyncio.sleep(A_WHILE_S)
        [told] = stand.events("line.order.violated")
        assert told.data == {"late": "reset-errors of r1", "before": "get-variable of r1"}


@in_virtual_time
async def test_c05_a_program_that_starts_with_the_power_is_told_and_a_stop_ends_it() -> None:
    async with rig() as stand:
        stand.axis().program = ("*A", "1+M900000", "WAT5", "JMP*A")
        for command in ("UAS1", "FUS", "FIS"):
            stand.axis().execute(command, _now())
            await asyncio.sleep(A_WHILE_S)  # the flash memory takes its time
        stand.machine.switch_body(0x3F, on=False, now=_now())
        await asyncio.sleep(A_WHILE_S)
        stand.machine.switch_body(0x3F, on=True, now=_now())
        await asyncio.sleep(2 * A_WHILE_S)
        assert stand.types("body.motion") == ["body.motion.foreign"]
        [stopped] = await stand.plant.stops.stop([stand.body()], "immediate")
        assert stopped.state == "confirmed"
        stands_at = stand.axis().position(_now())
        await asyncio.sleep(A_WHILE_S)
        assert stand.axis().position(_now()) == stands_at


@in_virtual_time
async def test_c10_two_bodies_with_one_number_are_not_understood_and_not_moved() -> None:
    async with rig() as stand:
        stand.wire.deaf_to = re.compile(rb"(?<=>&)3F")  # what both say at once is no number
        await asyncio.sleep(2 * A_WHILE_S)
        assert "body.offline" in stand.types("body")
        with pytest.raises(GatewayError):
            await start(stand, MoveClockwise(distance=500))
        assert (await finished(stand, MoveClockwise(distance=500), "00")).status is MoveStatus.SUCCEEDED
        assert not [frame for frame in stand.wire.frames() if frame.startswith("&3F1+M")]


@in_virtual_time
async def test_c11_the_end_of_the_position_index_refuses_a_move_and_nothing_is_repeated() -> None:
    async with rig() as stand:
        await stand.body().ask(SetPositionIndex(position=2047))
        with pytest.raises(ControllerRefused, match="out of range"):
            await start(stand, MoveClockwise(distance=PositionReference(position="next")))
        assert stand.wire.frames().count("&3F1+MP[+]") == 1


@in_virtual_time
async def test_c17_a_move_that_is_shorter_than_a_poll_is_not_missed() -> None:
    async with rig() as stand:
        move = await finished(stand, MoveClockwise(distance=1))
        assert (move.status, move.position) == (MoveStatus.SUCCEEDED, 1)


def test_g05_a_stop_that_a_crash_has_interrupted_has_stopped_the_motor(tmp_path: Path) -> None:
    @in_virtual_time
    async def story() -> None:
        world = World(tmp_path / "data")
        async with world.gateway() as plant:
            await asyncio.sleep(1.0)
            [move] = await plant.moves.start(plant.body("3F"), MoveClockwise(distance=200_000))
            await asyncio.sleep(1.0)
            stopping = plant.stops.stop([plant.body("3F")], "immediate")
            while not world.sent("5IS"):  # noqa: ASYNC110
                await asyncio.sleep(0.0001)
            world.crash()
            await stopping
        async with world.gateway() as plant:
            end = await plant.moves.wait(move.id, 60.0)
            assert end.status in (MoveStatus.STOPPED, MoveStatus.UNKNOWN)
            assert end.evidence
            stands_at = await _position(plant)
            await asyncio.sleep(A_WHILE_S)
            assert 0 < stands_at == await _position(plant) < 200_000
        assert len(world.sent("1+M")) == 1

    story()


def test_j08_only_keys_that_are_old_and_answered_are_forgotten(tmp_path: Path) -> None:
    disk = SqliteDisk(tmp_path)
    for days, keys in ((0.0, ("old", "old and under way")), (1.5, ("new",)), (2.0, ())):
        clock = writes.meta(writes.RAN_S, str(days * DAY_S))
        disk.commit([clock, *(writes.key_used("s", key, "digest", 0.0) for key in keys)], durable=True)
    disk.commit([writes.key_answered("s", key, 202, None, "{}") for key in ("old", "new")], durable=True)
    disk.close()
    files.prune(tmp_path, Retention())
    kept = {row["key"] for row in files.export(tmp_path) if row["table"] == "keys"}
    assert kept == {"new", "old and under way"}


async def _position(plant: TestedPlant) -> int:
    found = await plant.body("3F").poll()
    assert found
    return plant.body("3F").told.position or 0


def _now() -> float:
    return asyncio.get_running_loop().time()
