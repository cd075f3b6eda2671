"""Verdicts about a move whose reply, power or target was lost."""

import asyncio
from typing import Literal

import pytest

from gateway.core.errors import BodyBusy, ControllerRefused
from gateway.core.move_record import LOST_AFTER_S, Move, MoveStatus
from gateway.rorze.bodies import Configured
from protocols.rorze.modes import SetOperatingMode
from protocols.rorze.moves import MoveClockwise, MoveCounterclockwise, MoveTo
from protocols.rorze.origin import Home, HomeFastThenStop
from protocols.rorze.row import RorzeCommand
from protocols.table import Ack
from simulator.faults import Direction, Fault, Switch
from simulator.rorze.breakdowns import Breakdown
from simulator.rorze.controller import Rc420, Response
from simulator.rorze.world import EMS, Span
from tests.plants import Rig, ended, finished, finished_losing, in_virtual_time, lose, rig, start

LONG = MoveClockwise(distance=50_000)
SHORT = MoveClockwise(distance=5_000)
TO_5000 = MoveTo(position=5_000)
WITHOUT_MARK = "power_comment = 0"


# no reply


@in_virtual_time
async def test_a_lost_command_is_found_not_executed_and_not_sent_again() -> None:
    async with rig() as it:
        await finished(it, TO_5000)
        lose(it, Direction.REQUESTS)
        move = await finished(it, LONG)
        assert (move.status, move.end_cause) == (MoveStatus.FAILED, "not_executed")
        assert move.error is not None
        assert (move.error.type, move.error.moved) == ("not-executed", "no")
        assert "has not" in move.error.detail
        assert it.wire.frames().count("&3F1+M50000") == 1
        assert not it.executed("1+M")


@in_virtual_time
async def test_a_lost_reply_is_made_good_by_the_running_motor() -> None:
    async with rig() as it:
        await finished(it, TO_5000)
        lose(it, Direction.REPLIES)
        move = await finished(it, LONG)
        assert (move.status, move.position) == (MoveStatus.SUCCEEDED, 55_000)
        assert "executed, although no reply came" in move.evidence[0]
        assert move.acknowledged_at is None
        assert it.wire.frames().count("&3F1+M50000") == 1


@in_virtual_time
async def test_a_lost_reply_is_made_good_by_a_motor_that_stands_at_the_target() -> None:
    async with rig() as it:
        await finished(it, TO_5000)
        lose(it, Direction.REPLIES)
        move = await finished(it, MoveClockwise(distance=10))
        assert (move.status, move.position) == (MoveStatus.SUCCEEDED, 5_010)
        assert "stands at the target" in move.evidence[0]


@in_virtual_time
async def test_a_lost_reply_of_homing_stays_unknown_when_the_motor_stands_still() -> None:
    async with rig(baud=9600) as it:
        it.touch(0x3F, lambda axis: axis.world.forced.update({EMS: True}))
        move = await finished_losing(it, Home(), Direction.REPLIES)
        assert move.status is MoveStatus.UNKNOWN
        assert "proves nothing" in move.evidence[0]
        assert move.error is not None
        assert move.error.moved == "unknown"


# a refusal of a motor that had stood still


def double(rig: Rig) -> None:
    """Let the next request come twice, and lose the reply to its first copy."""
    rig.machine.faults.set(Switch(Fault.DOUBLED, Direction.REQUESTS, next_frames=1, delay_s=0.05))
    lose(rig, Direction.REPLIES)


async def finished_doubled(rig: Rig, command: RorzeCommand[Ack]) -> Move:
    """Start a move whose command comes twice, and wait for its end."""
    body = rig.body()
    starting = asyncio.create_task(start(rig, command))
    await rig.wire.begun(body.line.frame_of(body.number, command).removesuffix("\\r"))
    double(rig)
    return await ended(rig, await starting)


@in_virtual_time
async def test_a_doubled_command_whose_first_copy_was_executed_is_not_called_rejected() -> None:
    async with rig() as it:
        await finished(it, TO_5000)
        move = await finished_doubled(it, LONG)
        assert (move.status, move.position, move.error) == (MoveStatus.SUCCEEDED, 55_000, None)
        assert "refused 1+M as in motion (0x50), and had stood still" in move.evidence[0]
        assert "body.move.rejected" not in it.types("body.move")
        assert len(it.executed("1+M")) == 1


@in_virtual_time
async def test_where_a_refused_motor_comes_to_rest_elsewhere_nobody_knows_what_moved_it() -> None:
    async with rig() as it:
        await finished(it, TO_5000)
        starting = asyncio.create_task(start(it, LONG))
        await it.wire.begun("&3F1+M50000")
        run_by_hand(it)
        move = await it.plant.moves.wait((await starting).id, 600.0)
        assert (move.status, move.position) == (MoveStatus.UNKNOWN, 14_000)
        assert move.error is not None
        assert "refused 1+M as in motion, although it had stood still" in move.error.detail
        assert move.error.moved == "unknown"


@in_virtual_time
async def test_a_refusal_of_a_motor_that_rests_where_it_was_is_what_it_says() -> None:
    async with rig() as it:
        await finished(it, TO_5000)
        starting = asyncio.create_task(start(it, LONG))
        await it.wire.begun("&3F1+M50000")
        it.axis().breakdown = Breakdown(error=0x50, next_commands=1)
        with pytest.raises(ControllerRefused):
            await starting
        [move, *_] = it.plant.moves.log.of(it.body().address)
        assert (move.status, move.evidence) == (MoveStatus.REJECTED, [])


def run_by_hand(rig: Rig) -> None:
    """Let another host start the motor, for a long time."""
    rig.axis().execute("2+M9000", asyncio.get_running_loop().time())
    rig.machine.look_after(0x3F)
    rig.wire.turn()


@in_virtual_time
async def test_a_motor_that_ran_before_proves_nothing_of_a_search_and_is_not_sent_one() -> None:
    async with rig(baud=9600) as it:
        run_by_hand(it)
        sent = len(it.wire.sent)
        lose(it, Direction.REPLIES, frames=0)
        with pytest.raises(BodyBusy):
            await start(it, Home())
        assert "&3F00M" not in it.wire.frames(sent)
        [move] = it.plant.moves.log.of(it.body().address)
        assert (move.status, move.end_cause) == (MoveStatus.CANCELLED, None)


@in_virtual_time
async def test_a_lost_command_to_where_the_motor_stands_is_done_whatever_ended_the_last_move() -> None:
    async with rig(baud=9600) as it:
        stopped = await start(it, LONG)
        await asyncio.sleep(0.5)
        await it.plant.stops.stop([it.body()], "immediate")
        await ended(it, stopped)
        here = it.axis().position(asyncio.get_running_loop().time())
        move = await finished_losing(it, MoveTo(position=here), Direction.REQUESTS)
        assert (move.status, move.end_cause, move.error) == (MoveStatus.SUCCEEDED, None, None)
        assert "where it stood before" in move.evidence[-1]


@in_virtual_time
async def test_a_motor_that_stood_at_0_and_stands_there_again_may_have_moved_and_lost_its_power() -> None:
    async with rig(baud=9600, body_options=WITHOUT_MARK) as it:
        starting = asyncio.create_task(start(it, LONG))
        await it.wire.begun("&3F1+M50000")
        lose(it, Direction.REPLIES)
        await asyncio.sleep(0.4)
        assert it.axis().motor.moving
        await brown_out(it)
        move = await ended(it, await starting)
        assert (move.status, move.end_cause, move.position) == (MoveStatus.UNKNOWN, None, 0)
        assert move.error is not None
        assert move.error.moved == "unknown"


@in_virtual_time
async def test_a_lost_command_at_0_is_found_not_executed_where_the_controller_remembers_its_homing() -> None:
    async with rig(baud=9600, body_options=WITHOUT_MARK) as it:
        it.touch(0x3F, far_from_home)
        await finished(it, HOME)
        assert it.axis().position(asyncio.get_running_loop().time()) == 0
        move = await finished_losing(it, LONG, Direction.REQUESTS)
        assert (move.status, move.end_cause) == (MoveStatus.FAILED, "not_executed")
        assert "has kept its power" in move.evidence[0]


def stop_beside(rig: Rig, monkeypatch: pytest.MonkeyPatch, pulses: int) -> None:
    """Let the encoder find the motor beside the place where its pulses have brought it."""
    axis = rig.axis()
    execute = axis.execute

    def beside(text: str, now: float) -> Response:
        stopped_at = axis.position(now)
        stands_there = text == "6PD" and stopped_at and not axis.motor.moving
        return Response(f"{stopped_at + pulses:+010d}") if stands_there else execute(text, now)

    monkeypatch.setattr(axis, "execute", beside)


@pytest.mark.parametrize(
    ("mode", "missed_by", "status"),
    [
        ("encoder", 3, MoveStatus.SUCCEEDED),
        ("encoder", -3, MoveStatus.SUCCEEDED),
        ("encoder", 4, MoveStatus.FAILED),
        ("stepping", 3, MoveStatus.FAILED),
    ],
)
@in_virtual_time
async def test_only_an_encoder_may_find_the_motor_beside_its_target(
    mode: Literal["encoder", "stepping"], missed_by: int, status: MoveStatus, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig() as it:
        it.body().configured = Configured(position_tolerance=3)
        await it.body().ask(SetOperatingMode(mode=mode))
        stop_beside(it, monkeypatch, missed_by)
        move = await finished(it, SHORT)
        assert (move.status, move.position) == (status, 5_000 + missed_by)
        assert move.end_cause == ("normal" if status is MoveStatus.SUCCEEDED else "position_mismatch")


@in_virtual_time
async def test_a_lost_move_that_is_shorter_than_the_tolerance_is_not_taken_for_done() -> None:
    async with rig(baud=9600) as it:
        it.body().configured = Configured(position_tolerance=3)
        await it.body().ask(SetOperatingMode(mode="encoder"))
        await finished(it, TO_5000)
        move = await finished_losing(it, MoveClockwise(distance=2), Direction.REQUESTS)
        assert (move.status, move.end_cause) == (MoveStatus.FAILED, "not_executed")


def mishear(rig: Rig, monkeypatch: pytest.MonkeyPatch, said: str, heard: str) -> None:
    """Let an axis hear another command than was sent."""
    execute = rig.axis().execute
    monkeypatch.setattr(
        rig.axis(), "execute", lambda text, now: execute(heard if text == said else text, now)
    )


@in_virtual_time
async def test_a_garbled_distance_is_found_by_the_final_position(monkeypatch: pytest.MonkeyPatch) -> None:
    async with rig() as it:
        mishear(it, monkeypatch, said="1+M5000", heard="1+M5001")
        move = await finished(it, SHORT)
        assert (move.status, move.end_cause) == (MoveStatus.FAILED, "position_mismatch")
        assert (move.target_position, move.position) == (5_000, 5_001)
        assert move.error is not None
        assert move.error.moved == "yes"


@in_virtual_time
async def test_one_garbled_position_does_not_make_a_good_move_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    async with rig() as it:
        move = await start(it, SHORT)
        execute = it.axis().execute
        garbled: list[str] = []

        def once_garbled(text: str, now: float) -> Response:
            response = execute(text, now)
            if text != "6PD" or it.axis().motor.moving or garbled:
                return response
            garbled.append(text)
            return Response("+000005001")

        monkeypatch.setattr(it.axis(), "execute", once_garbled)
        await ended(it, move)
        assert garbled
        assert (move.status, move.position) == (MoveStatus.SUCCEEDED, 5_000)


@in_virtual_time
async def test_one_garbled_status_does_not_end_a_move_that_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    async with rig() as it:
        move = await start(it, LONG)
        await asyncio.sleep(0.5)
        execute = it.axis().execute
        garbled: list[str] = []

        def once_garbled(text: str, now: float) -> Response:
            response = execute(text, now)
            if text != "9CD" or garbled:
                return response
            garbled.append(text)
            return Response("H00")

        monkeypatch.setattr(it.axis(), "execute", once_garbled)
        await ended(it, move)
        assert garbled
        assert (move.status, move.position) == (MoveStatus.SUCCEEDED, 50_000)


@in_virtual_time
async def test_a_silent_body_has_lost_its_move() -> None:
    async with rig() as it:
        move = await start(it, LONG)
        await asyncio.sleep(0.5)
        it.machine.switch_body(0x3F, on=False, now=asyncio.get_running_loop().time())
        cut_at = asyncio.get_running_loop().time()
        await ended(it, move)
        assert move.status is MoveStatus.LOST
        assert LOST_AFTER_S <= asyncio.get_running_loop().time() - cut_at < LOST_AFTER_S + 5
        assert "body.offline" in it.types()


@pytest.mark.parametrize("away_s", [0.2, 5.0])
@in_virtual_time
async def test_a_body_that_lost_its_power_in_the_middle_has_lost_its_move(away_s: float) -> None:
    async with rig() as it:
        await finished(it, SHORT)
        move = await start(it, LONG)
        await asyncio.sleep(0.5)
        it.machine.switch_body(0x3F, on=False, now=asyncio.get_running_loop().time())
        await asyncio.sleep(away_s)
        it.machine.switch_body(0x3F, on=True, now=asyncio.get_running_loop().time())
        await ended(it, move)
        assert move.status is MoveStatus.LOST
        assert move.error is not None
        assert "power" in move.error.detail


@in_virtual_time
async def test_a_search_in_which_the_power_was_lost_has_not_found_the_origin() -> None:
    async with rig() as it:
        it.touch(0x3F, lambda axis: setattr(axis.world, "origin", Span(-90_000, -80_000)))
        move = await start(it, Home())
        await asyncio.sleep(0.5)
        it.machine.switch_body(0x3F, on=False, now=asyncio.get_running_loop().time())
        await asyncio.sleep(5.0)
        it.machine.switch_body(0x3F, on=True, now=asyncio.get_running_loop().time())
        await ended(it, move)
        assert move.status is MoveStatus.LOST


def cut_power(rig: Rig) -> None:
    """Take the power away."""
    rig.machine.switch_body(0x3F, on=False, now=asyncio.get_running_loop().time())


async def brown_out(rig: Rig) -> None:
    """Leave the controller without power for 50 ms."""
    cut_power(rig)
    await asyncio.sleep(0.05)
    rig.machine.switch_body(0x3F, on=True, now=asyncio.get_running_loop().time())


def far_from_home(axis: Rc420) -> None:
    """Put the origin where a search takes seconds."""
    axis.world.origin = Span(-90_000, -80_000)


HOME = HomeFastThenStop()
TO_0 = MoveTo(position=0)
BACK_TO_0 = MoveCounterclockwise(distance=50_000)


@pytest.mark.parametrize("command", [HOME, TO_0, BACK_TO_0])
@in_virtual_time
async def test_a_move_to_0_in_which_the_power_was_lost_for_a_moment_is_not_taken_for_done(
    command: RorzeCommand[Ack],
) -> None:
    async with rig(body_options=WITHOUT_MARK) as it:
        it.touch(0x3F, far_from_home)
        await finished(it, LONG)
        move = await start(it, command)
        await asyncio.sleep(0.5)
        await brown_out(it)
        await ended(it, move)
        assert (move.status, move.end_cause, move.position) == (MoveStatus.UNKNOWN, None, 0)
        assert "as after a loss of power" in move.evidence[-2]
        assert "seems to have lost its power" in move.evidence[-1]
        assert move.error is not None
        assert "lost its power" in move.error.detail
        assert move.error.moved == "unknown"


@in_virtual_time
async def test_a_search_after_a_search_in_which_the_power_was_lost_is_not_taken_for_done() -> None:
    async with rig(body_options=WITHOUT_MARK) as it:
        it.touch(0x3F, far_from_home)
        await finished(it, HOME)
        await finished(it, LONG)
        move = await start(it, HOME)
        await asyncio.sleep(0.5)
        await brown_out(it)
        await ended(it, move)
        assert move.status is MoveStatus.UNKNOWN


@pytest.mark.parametrize("command", [HOME, TO_0, BACK_TO_0])
@in_virtual_time
async def test_a_move_to_0_in_which_the_power_was_lost_for_a_moment_is_lost_where_the_mark_is_gone(
    command: RorzeCommand[Ack],
) -> None:
    async with rig() as it:
        it.touch(0x3F, far_from_home)
        await finished(it, LONG)
        move = await start(it, command)
        await asyncio.sleep(0.5)
        await brown_out(it)
        await ended(it, move)
        assert (move.status, move.position) == (MoveStatus.LOST, 0)
        assert move.error is not None
        assert "has lost its power" in move.error.detail


@in_virtual_time
async def test_a_motor_that_stood_at_0_and_stands_there_again_without_its_mark_has_lost_its_power() -> None:
    async with rig(baud=9600) as it:
        starting = asyncio.create_task(start(it, LONG))
        await it.wire.begun("&3F1+M50000")
        lose(it, Direction.REPLIES)
        await asyncio.sleep(0.4)
        await brown_out(it)
        move = await ended(it, await starting)
        assert (move.status, move.position) == (MoveStatus.LOST, 0)


@in_virtual_time
async def test_a_lost_command_at_0_is_found_not_executed_where_the_mark_stands() -> None:
    async with rig(baud=9600) as it:
        move = await finished_losing(it, LONG, Direction.REQUESTS)
        assert (move.status, move.end_cause) == (MoveStatus.FAILED, "not_executed")


@pytest.mark.parametrize("command", [HOME, TO_0, BACK_TO_0])
@in_virtual_time
async def test_a_move_to_0_whose_end_is_announced_has_succeeded(command: RorzeCommand[Ack]) -> None:
    async with rig() as it:
        await finished(it, LONG)
        move = await finished(it, command)
        assert (move.status, move.end_cause, move.position) == (MoveStatus.SUCCEEDED, "normal", 0)
        assert (move.completion, move.evidence) == ("frame", [])


def forget_set_up(rig: Rig) -> None:
    """Restart the link master: it announces no end from now on."""
    rig.machine.power_off(asyncio.get_running_loop().time())
    rig.machine.power_on(asyncio.get_running_loop().time())


@pytest.mark.parametrize("command", [TO_0, BACK_TO_0])
@in_virtual_time
async def test_an_end_at_0_that_nobody_announces_proves_nothing_to_who_was_never_homed(
    command: RorzeCommand[Ack],
) -> None:
    async with rig(body_options=WITHOUT_MARK) as it:
        await finished(it, LONG)
        forget_set_up(it)
        move = await finished(it, command)
        assert (move.status, move.completion) == (MoveStatus.UNKNOWN, "polling")
        assert it.axis().position(asyncio.get_running_loop().time()) == 0


@pytest.mark.parametrize("command", [HOME, TO_0, BACK_TO_0])
@in_virtual_time
async def test_an_end_at_0_that_nobody_announces_is_proved_by_a_homing_that_is_remembered(
    command: RorzeCommand[Ack],
) -> None:
    async with rig(body_options=WITHOUT_MARK) as it:
        it.touch(0x3F, far_from_home)
        await finished(it, HOME)
        await finished(it, LONG)
        forget_set_up(it)
        move = await finished(it, command)
        assert (move.status, move.completion, move.position) == (MoveStatus.SUCCEEDED, "polling", 0)
        assert "has kept its power" in move.evidence[-1]


@pytest.mark.parametrize("command", [HOME, TO_0, BACK_TO_0])
@in_virtual_time
async def test_an_end_at_0_that_nobody_announces_is_proved_by_the_mark(command: RorzeCommand[Ack]) -> None:
    async with rig() as it:
        await finished(it, LONG)
        forget_set_up(it)
        move = await finished(it, command)
        assert (move.status, move.completion, move.position) == (MoveStatus.SUCCEEDED, "polling", 0)


@in_virtual_time
async def test_an_end_that_is_announced_late_is_waited_for_at_0() -> None:
    async with rig(body_options=WITHOUT_MARK) as it:
        await finished(it, LONG)
        forget_set_up(it)
        move = await start(it, TO_0)
        await asyncio.sleep(2.3)
        assert not it.axis().motor.moving
        assert not move.status.final
        it.body().motion.announced.set()
        await ended(it, move)
        assert (move.status, move.completion) == (MoveStatus.SUCCEEDED, "frame")


@in_virtual_time
async def test_a_move_after_a_loss_of_power_at_rest_starts_where_the_controller_says() -> None:
    async with rig() as it:
        await finished(it, SHORT)
        await asyncio.sleep(1.0)
        await brown_out(it)
        move = await finished(it, SHORT)
        assert (move.start_position, move.target_position) == (0, 5_000)
        assert (move.status, move.position) == (MoveStatus.SUCCEEDED, 5_000)


@in_virtual_time
async def test_a_loss_of_power_just_before_a_move_is_named_as_a_cause_of_its_wrong_end() -> None:
    async with rig(body_options=WITHOUT_MARK) as it:
        await finished(it, SHORT)
        await brown_out(it)
        move = await finished(it, SHORT)
        assert move.status is MoveStatus.LOST
        assert move.error is not None
        assert "seems to have lost its power" in move.error.detail


@in_virtual_time
async def test_a_cable_pulled_in_the_middle_and_put_back_costs_nothing() -> None:
    async with rig() as it:
        move = await start(it, LONG)
        await asyncio.sleep(0.5)
        it.wire.unplug()
        await asyncio.sleep(1.0)
        it.wire.plugged_in = True
        await ended(it, move)
        assert (move.status, move.position) == (MoveStatus.SUCCEEDED, 50_000)
