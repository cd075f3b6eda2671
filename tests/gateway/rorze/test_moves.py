"""The lives of moves, told by what the controllers did and what the gateway says they did."""

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

from gateway.core.errors import BodyBusy, BodyOffline, Cancelled, ControllerRefused, Expired, PortNotOpen
from gateway.core.move_record import MoveStatus
from gateway.core.stops import StopMode
from gateway.rorze.bodies import Body
from gateway.rorze.move_proof import CAUSES
from protocols.rorze.moves import MoveClockwise, MoveCounterclockwise, MoveTo
from protocols.rorze.notation import PositionReference
from protocols.rorze.origin import Home
from protocols.rorze.position import GetPosition, SetPosition
from protocols.rorze.position_table import GetPositionEntry, SetPositionEntry
from protocols.rorze.row import RorzeCommand
from protocols.table import Ack
from simulator.faults import Direction
from simulator.rorze.controller import Rc420, StallFinder
from simulator.rorze.world import EMS, Span
from tests.plants import ended, finished, in_virtual_time, lose, rig, start

Change = Callable[[Rc420], object]

LONG = MoveClockwise(distance=50_000)
SHORT = MoveClockwise(distance=5_000)
TO_5000 = MoveTo(position=5_000)


# the good end


@in_virtual_time
async def test_a_move_is_queued_sent_seen_moving_and_ends_at_its_target() -> None:
    async with rig() as it:
        move = await start(it, LONG)
        assert move.status == "sent"
        assert (move.frame, move.kind, move.start_position, move.target_position) == (
            "&3F1+M50000\\r",
            "relative",
            0,
            50_000,
        )
        await asyncio.sleep(0.5)
        assert move.status == "moving"
        assert 0 < (move.position or 0) < 50_000
        await ended(it, move)
        assert (move.status, move.end_cause, move.position) == (MoveStatus.SUCCEEDED, "normal", 50_000)
        assert None not in (move.sent_at, move.acknowledged_at, move.ended_at)
        assert it.types("body.move") == [
            f"body.move.{step}" for step in ("queued", "sent", "started", "succeeded")
        ]
        assert it.plant.moves.get(move.id) == move
        assert it.plant.moves.log.of(it.body().address) == [move]


@in_virtual_time
async def test_the_end_is_noticed_at_once_when_the_link_master_announces_it() -> None:
    async with rig() as it:
        move = await finished(it, LONG)
        [stop] = it.truth.of("pulses_stop")
        assert move.completion == "frame"
        assert asyncio.get_running_loop().time() - stop.at < 0.05


@in_virtual_time
async def test_a_move_that_is_over_in_a_moment_is_asked_about_once() -> None:
    async with rig() as it:
        sent = len(it.wire.sent)
        move = await finished(it, MoveClockwise(distance=1))
        frames = it.wire.frames(sent)
        assert frames[frames.index(move.frame.removesuffix("\\r")) + 1 :] == ["&3F9CD", "&3F6PD", "&3F9MD"]
        assert (move.status, move.completion) == (MoveStatus.SUCCEEDED, "frame")


@in_virtual_time
async def test_without_announcements_the_end_is_found_by_polling_and_the_link_set_up_again() -> None:
    async with rig() as it:
        it.machine.power_off(asyncio.get_running_loop().time())
        it.machine.power_on(asyncio.get_running_loop().time())
        sent = len(it.wire.sent)
        move = await finished(it, LONG)
        assert (move.status, move.completion) == (MoveStatus.SUCCEEDED, "polling")
        await asyncio.sleep(1.0)
        told = [frame for frame in it.wire.frames(sent) if frame.startswith("&7F")]
        assert told[-3:] == ["&7FXID", "&7FXRSM1", "&7FXVS80,00,01"]
        assert (await finished(it, LONG)).completion == "frame"


@in_virtual_time
async def test_a_late_announcement_of_an_earlier_end_does_not_end_the_move() -> None:
    async with rig() as it:
        move = await start(it, LONG)
        await asyncio.sleep(0.3)
        it.body().motion.announced.set()
        sent = len(it.wire.sent)
        await asyncio.sleep(1.0)
        assert move.status is MoveStatus.MOVING
        assert len(it.wire.frames(sent)) < 20
        assert (await ended(it, move)).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_an_absolute_move_from_the_position_table_knows_its_target() -> None:
    async with rig() as it:
        await it.body().ask(SetPositionEntry(entry=PositionReference(position=25), pulses=-700))
        move = await finished(it, MoveTo(position=PositionReference(position=25)))
        assert (move.kind, move.target_position, move.position) == ("absolute", -700, -700)
        assert move.status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_homing_ends_at_the_origin_without_a_target_known_before() -> None:
    async with rig() as it:
        move = await finished(it, Home())
        assert (move.kind, move.status, move.target_position) == ("home", MoveStatus.SUCCEEDED, None)


@in_virtual_time
async def test_the_second_of_two_moves_needs_no_question_where_the_first_has_ended() -> None:
    async with rig() as it:
        await finished(it, SHORT)
        sent = len(it.wire.sent)
        move = await start(it, SHORT)
        frames = it.wire.frames(sent)
        assert not {"&3F9CD", "&3F6PD"} & set(frames[: frames.index("&3F1+M5000")])
        assert (await ended(it, move)).position == 10_000


@in_virtual_time
async def test_a_position_set_in_between_counts_from_then_on() -> None:
    async with rig() as it:
        await finished(it, SHORT)
        await it.body().ask(SetPosition(position=100))
        move = await finished(it, SHORT)
        assert (move.start_position, move.position, move.status) == (100, 5_100, MoveStatus.SUCCEEDED)


# refused


def _ems(axis: Rc420) -> None:
    axis.world.forced[EMS] = True


def _stalled(axis: Rc420) -> None:
    axis.stalls.add(StallFinder.SENSOR)


def _at_the_limit(axis: Rc420) -> None:
    axis.world.cw_limit = Span(-10, 10)


@pytest.mark.parametrize(
    ("hindrance", "command", "code"),
    [
        (_ems, SHORT, "0x51"),
        (_stalled, SHORT, "0x52"),
        (_at_the_limit, SHORT, "0x55"),
        (lambda _: None, MoveClockwise(distance=5, pattern=3), "0x47"),
        (lambda _: None, MoveClockwise(distance=PositionReference(position=7)), "0x5D"),
    ],
)
@in_virtual_time
async def test_a_refusal_moves_nothing_and_says_why(
    hindrance: Change, command: RorzeCommand[Ack], code: str
) -> None:
    async with rig() as it:
        it.touch(0x3F, hindrance)
        with pytest.raises(ControllerRefused):
            await start(it, command)
        [move] = it.plant.moves.log.of(it.body().address)
        assert move.status is MoveStatus.REJECTED
        assert move.error is not None
        assert (move.error.controller_error, move.error.moved) == (code, "no")
        assert not it.truth.of("pulses_start")
        assert it.body().move is None


@in_virtual_time
async def test_a_body_that_another_host_moves_is_sent_nothing_and_is_known_to_move() -> None:
    async with rig() as it:
        it.axis().execute("1+MZ", asyncio.get_running_loop().time())
        sent = len(it.wire.sent)
        with pytest.raises(BodyBusy, match=r"line1\.3F moves already, .*; 1\+M was not sent"):
            await start(it, SHORT)
        [move] = it.plant.moves.log.of(it.body().address)
        assert (move.status, move.sent_at) == (MoveStatus.CANCELLED, None)
        await asyncio.sleep(0.1)
        assert it.body().moving
        assert it.body().told.rest is None
        assert it.types("body.motion") == ["body.motion.foreign"]
        assert not [frame for frame in it.wire.frames(sent) if "1+M" in frame]


@in_virtual_time
async def test_a_body_that_begins_to_move_just_before_the_command_is_followed_until_it_is_stopped() -> None:
    async with rig(baud=9600) as it:
        starting = asyncio.create_task(start(it, SHORT))
        await it.wire.begun("&3F1+M5000")
        it.axis().execute("1+MZ", asyncio.get_running_loop().time())
        move = await starting
        assert "something else moves the motor" in move.evidence[0]
        await asyncio.sleep(0.5)
        assert it.body().moving
        assert it.body().told.rest is None
        await it.plant.stops.stop([it.body()], "immediate")
        assert (await ended(it, move)).status is MoveStatus.STOPPED


@in_virtual_time
async def test_a_body_takes_one_move_at_a_time() -> None:
    async with rig() as it:
        move = await start(it, LONG)
        with pytest.raises(BodyBusy, match=move.id):
            await start(it, SHORT)
        await ended(it, move)
        assert len(it.executed("1+M")) == 1
        assert (await finished(it, SHORT)).status is MoveStatus.SUCCEEDED


# ended early


@pytest.mark.parametrize(("mode", "ramp"), [("immediate", False), ("decelerate", True)])
@in_virtual_time
async def test_a_stop_ends_a_move_as_stopped(mode: StopMode, ramp: bool) -> None:
    async with rig() as it:
        move = await start(it, LONG)
        await asyncio.sleep(1.0)
        before = it.axis().position(asyncio.get_running_loop().time())
        await it.plant.stops.stop([it.body()], mode)
        await ended(it, move)
        assert (move.status, move.end_cause, move.error) == (MoveStatus.STOPPED, "stop_command", None)
        assert (move.position != before) == ramp


@pytest.mark.parametrize(
    ("place", "cause"),
    [
        (lambda axis: setattr(axis.world, "cw_limit", Span(20_000, 21_000)), "cw_limit"),
        (lambda axis: axis.world.forced.update({EMS: True}), "ems"),
    ],
)
@in_virtual_time
async def test_a_sensor_ends_a_move_as_failed_with_its_cause(place: Change, cause: str) -> None:
    async with rig() as it:
        move = await start(it, LONG)
        await asyncio.sleep(0.5)
        it.touch(0x3F, place)
        await ended(it, move)
        assert (move.status, move.end_cause) == (MoveStatus.FAILED, cause)
        assert move.error is not None
        assert (move.error.type, move.error.moved) == ("move-failed", "yes")
        assert f" {CAUSES[cause]}; the motor stands still." in move.error.detail


@in_virtual_time
async def test_a_stall_ends_a_move_as_failed() -> None:
    async with rig() as it:
        await it.body().ask(SetPosition(position=0))
        move = await start(it, LONG)
        await asyncio.sleep(0.5)
        axis = it.axis()
        axis.motor.stop(1, asyncio.get_running_loop().time())
        axis.sense(asyncio.get_running_loop().time())
        await ended(it, move)
        assert (move.status, move.end_cause) == (MoveStatus.FAILED, "stall")


# never sent


@in_virtual_time
async def test_a_stop_cancels_a_move_that_waits_for_the_line() -> None:
    async with rig(baud=9600) as it:
        reads = [it.body("00").ask(GetPosition()) for _ in range(3)]
        waiting = asyncio.gather(*reads, start(it, LONG), return_exceptions=True)
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        await it.plant.stops.stop([it.body()], "immediate")
        *_, refused = await waiting
        assert isinstance(refused, Cancelled)
        [move] = it.plant.moves.log.of(it.body().address)
        assert move.status is MoveStatus.CANCELLED
        await asyncio.sleep(5.0)
        assert not it.executed("1+M")


@in_virtual_time
async def test_a_stop_cancels_a_move_whose_start_is_still_being_asked_for() -> None:
    async with rig(baud=9600) as it:
        starting = asyncio.create_task(start(it, LONG))
        await it.wire.begun("&3F6PD")
        await it.plant.stops.stop([it.body()], "immediate")
        with pytest.raises(Cancelled, match="A stop came first"):
            await starting
        await asyncio.sleep(5.0)
        assert not it.executed("1+M")


@in_virtual_time
async def test_nothing_is_sent_while_the_line_is_down() -> None:
    async with rig() as it:
        it.wire.unplug()
        with pytest.raises(PortNotOpen):
            await start(it, LONG)
        [move] = it.plant.moves.log.of(it.body().address)
        assert move.status is MoveStatus.CANCELLED
        it.wire.plugged_in = True
        await asyncio.sleep(20.0)
        assert it.plant.line("line1").state == "ready"
        assert not it.executed("1+M")


@in_virtual_time
async def test_a_move_that_cannot_start_in_time_never_starts() -> None:
    async with rig(bodies=(0x00, 0x3F), groups={}) as it:
        it.machine.switch_body(0x00, on=False, now=asyncio.get_running_loop().time())
        blocking = [asyncio.create_task(it.body("00").ask(GetPosition()))]
        await asyncio.sleep(0)
        asked_at = asyncio.get_running_loop().time()
        with pytest.raises(Expired):
            await it.plant.moves.start(it.body(), LONG, start_within_s=1.0)
        assert asyncio.get_running_loop().time() == pytest.approx(asked_at + 1.0), "no question keeps it"
        await asyncio.gather(*blocking, return_exceptions=True)
        await asyncio.sleep(5.0)
        assert not it.executed("1+M")


@in_virtual_time
async def test_many_readers_do_not_keep_a_move_from_starting() -> None:
    async with rig(bodies=range(8), groups={}, baud=9600) as it:
        readers = [
            asyncio.create_task(read_on(body, GetPositionEntry(entry=PositionReference(position=number))))
            for body in it.plant.bodies()
            for number in range(15)
        ]
        await asyncio.sleep(5.0)
        asked_at = asyncio.get_running_loop().time()
        move = await start(it, SHORT, "03")
        assert move.sent_at is not None
        assert asyncio.get_running_loop().time() - asked_at < 0.5
        for reader in readers:
            reader.cancel()


async def read_on(body: Body, question: RorzeCommand[Any]) -> None:
    """Read without a pause."""
    while True:
        await body.ask(question)


@in_virtual_time
async def test_a_move_of_a_body_that_is_offline_is_cancelled() -> None:
    async with rig(present=(0x00, 0x01)) as it:
        await asyncio.sleep(10.0)
        with pytest.raises(BodyOffline):
            await start(it, SHORT)
        assert it.plant.moves.log.of(it.body().address)[0].status is MoveStatus.CANCELLED


# groups


@in_virtual_time
async def test_a_group_moves_together_with_a_move_for_each_member() -> None:
    async with rig() as it:
        moves = await it.plant.moves.start(it.plant.group("80"), SHORT)
        for move in moves:
            await ended(it, move)
        assert [move.body_id for move in moves] == ["line1.00", "line1.01"]
        assert {move.group_id for move in moves} == {"line1.80"}
        assert {(move.status, move.position) for move in moves} == {(MoveStatus.SUCCEEDED, 5_000)}
        assert it.wire.frames().count("&801+M5000") == 1
        first, second = it.truth.of("pulses_start")
        assert first.at == second.at


@in_virtual_time
async def test_a_member_that_refuses_has_a_rejected_move_of_its_own() -> None:
    async with rig() as it:
        it.touch(0x01, _ems)
        one, other = await it.plant.moves.start(it.plant.group("80"), SHORT)
        await ended(it, one)
        assert (one.status, other.status) == (MoveStatus.SUCCEEDED, MoveStatus.REJECTED)
        assert other.error is not None
        assert other.error.controller_error == "0x51"


@in_virtual_time
async def test_a_member_that_the_reply_leaves_out_is_asked_itself() -> None:
    async with rig() as it:
        for address in ("00", "01"):
            await finished(it, SHORT, address)
        it.machine.switch_body(0x01, on=False, now=asyncio.get_running_loop().time())
        one, other = await it.plant.moves.start(it.plant.group("80"), LONG)
        await ended(it, one)
        await ended(it, other)
        assert (one.status, other.status) == (MoveStatus.SUCCEEDED, MoveStatus.LOST)


@in_virtual_time
async def test_a_lost_group_command_is_resolved_for_each_member() -> None:
    async with rig() as it:
        for move in [await start(it, SHORT, address) for address in ("00", "01")]:
            await ended(it, move)
        lose(it, Direction.REQUESTS)
        moves = await it.plant.moves.start(it.plant.group("80"), LONG)
        for move in moves:
            await ended(it, move)
        assert [move.end_cause for move in moves] == ["not_executed", "not_executed"]


@in_virtual_time
async def test_what_one_member_will_not_tell_beforehand_is_no_refusal_of_the_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with rig() as it:
        axis = it.axis(0x01)
        execute = axis.execute
        monkeypatch.setattr(
            axis, "execute", lambda text, now: execute("3PDP[4000]" if text.startswith("3PD") else text, now)
        )
        it.axis(0x00).execute("1+MZ", asyncio.get_running_loop().time())
        await it.body("00").poll()
        it.axis(0x00).execute("5IS", asyncio.get_running_loop().time())
        await it.body("00").poll()
        with pytest.raises(ControllerRefused, match=r"line1\.01 refused 3PD"):
            await it.plant.moves.start(it.plant.group("80"), MoveTo(position=PositionReference(position=25)))
        one, other = (it.plant.moves.log.of(it.body(address).address)[0] for address in ("00", "01"))
        assert (one.status, other.status) == (MoveStatus.CANCELLED, MoveStatus.REJECTED)
        assert [it.body(address).moving for address in ("00", "01")] == [False, False]


@in_virtual_time
async def test_a_group_with_a_busy_member_is_not_started() -> None:
    async with rig() as it:
        move = await start(it, LONG, "01")
        with pytest.raises(BodyBusy, match=r"line1\.01"):
            await it.plant.moves.start(it.plant.group("80"), SHORT)
        await ended(it, move)
        assert not it.executed("1+M", 0x00)


@in_virtual_time
async def test_a_stop_of_one_member_cancels_the_group_command_that_waits() -> None:
    async with rig(baud=9600) as it:
        starting = asyncio.create_task(it.plant.moves.start(it.plant.group("80"), LONG))
        await it.wire.begun("&006PD")
        await it.plant.stops.stop([it.body("01")], "decelerate")
        with pytest.raises(Cancelled):
            await starting
        await asyncio.sleep(1.0)
        assert not it.executed("1+M")


# memory


@in_virtual_time
async def test_moves_that_end_are_remembered_newest_first_and_waiting_has_an_end() -> None:
    async with rig() as it:
        first = await finished(it, SHORT)
        second = await start(it, MoveCounterclockwise(distance=50_000))
        assert await it.plant.moves.wait(second.id, 0.1) is second
        assert not second.status.final
        assert it.plant.moves.log.of(it.body().address) == [second, first]
        await ended(it, second)


@in_virtual_time
async def test_a_gateway_that_shuts_down_sends_nothing_more() -> None:
    async with rig(baud=9600) as it:
        reading = asyncio.gather(
            *(it.body("00").ask(GetPosition()) for _ in range(2)), return_exceptions=True
        )
        starting = asyncio.gather(start(it, LONG), return_exceptions=True)
        await asyncio.sleep(0)
        await it.plant.close()
        await asyncio.gather(reading, starting)
        assert not it.executed("1+M")
        assert it.plant.moves.log.of(it.body().address)[0].status is MoveStatus.CANCELLED
