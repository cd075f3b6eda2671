"""Software stops: ahead of everything, repeated, and believed only when the controller stands still."""

import asyncio
import re
from contextlib import suppress
from datetime import UTC, datetime

import pytest

from gateway.core.errors import Cancelled, GatewayError
from gateway.core.move_record import Move
from gateway.core.stops import CONFIRM_WITHIN_S, HURRY_S, PROVED_WITHIN_S, StopMode
from gateway.rorze.bodies import Body
from protocols.rorze.inputs_outputs import GetSensors
from protocols.rorze.moves import MoveClockwise, MoveClockwiseSlowly
from protocols.rorze.position import GetEncoderPosition, GetPosition
from protocols.rorze.speeds import (
    SetFallingAccelerationShare,
    SetMaximumAcceleration,
    SetMaximumSpeed,
    SetRisingAccelerationShare,
    SetStartSpeed,
)
from protocols.rorze.status import GetControllerStatus, GetEndCause
from protocols.rorze.stops import SetStopSpeedSet
from simulator.faults import Direction, Fault, Switch
from simulator.rorze.controller import Response
from simulator.rorze.rc400 import LinkSettings
from tests.gateway.rorze.far_end import until
from tests.plants import Rig, in_virtual_time, rig

FAR = MoveClockwise(distance=500_000)
STOP_FRAMES = {"immediate": "5IS", "decelerate": "5SS"}


def now() -> float:
    """The time of the running loop."""
    return asyncio.get_running_loop().time()


async def moving(rig: Rig, *addresses: str) -> list[Move]:
    """Set bodies moving, and let them come up to speed."""
    started = [await rig.plant.moves.start(rig.body(address), FAR) for address in addresses]
    await asyncio.sleep(1.0)
    return [move for [move] in started]


def hold_still_by_truth(rig: Rig, since: float) -> bool:
    """Say whether no pulse train has started since, and none is under way."""
    started = [fact for fact in rig.truth.of("pulses_start") if fact.at >= since]
    return not started and not any(axis.motor.moving for axis in rig.machine.axes.values())


# the good end


@pytest.mark.parametrize("mode", ["immediate", "decelerate"])
@in_virtual_time
async def test_a_stop_is_confirmed_when_the_controller_stands_still(mode: StopMode) -> None:
    async with rig() as it:
        [move] = await moving(it, "3F")
        began_at, sent = now(), len(it.wire.sent)
        [report] = await it.plant.stops.stop([it.body()], mode)
        assert (report.body_id, report.state, report.detail) == ("line1.3F", "confirmed", None)
        assert report.position == it.axis().position(now())
        assert it.wire.frames(sent)[0] == f"&3F{STOP_FRAMES[mode]}"
        assert it.types("body.stop") == ["body.stop.requested", "body.stop.confirmed"]
        await it.plant.moves.wait(move.id, 10.0)
        assert move.status == "stopped"
        await asyncio.sleep(5.0)
        assert hold_still_by_truth(it, began_at)


@in_virtual_time
async def test_every_stop_frame_leaves_before_anything_else() -> None:
    async with rig() as it:
        await moving(it, "00", "01", "3F")
        sent = len(it.wire.sent)
        reports = await it.plant.stops.stop(it.plant.bodies(), "immediate")
        assert [report.state for report in reports] == ["confirmed"] * 3
        assert it.wire.frames(sent)[:4] == ["&805IS", "&005IS", "&015IS", "&3F5IS"]
        assert {sent.at for sent in it.wire.sent[sent : sent + 4]} == {it.wire.sent[sent].at}


@in_virtual_time
async def test_a_user_program_is_ended_too_lest_it_starts_the_next_move() -> None:
    async with rig() as it:
        await moving(it, "3F")
        sent = len(it.wire.sent)
        await it.plant.stops.stop([it.body()], "immediate")
        frames = it.wire.frames(sent)
        assert frames.index("&3F5IS") < frames.index("&3FUES0") < frames.index("&3F9CD0")


@in_virtual_time
async def test_a_stop_is_not_confirmed_while_a_program_runs_that_could_move_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with rig() as it:
        await moving(it, "3F")
        execute = it.axis().execute
        program = ["runs on, as if the first UES0 had been lost", "runs"]

        def with_a_program(text: str, at: float) -> Response:
            if text == "UES0":
                program.pop()
                return Response("")
            return Response("H01" if program else "H00") if text == "URD" else execute(text, at)

        monkeypatch.setattr(it.axis(), "execute", with_a_program)
        [report] = await it.plant.stops.stop([it.body()], "immediate")
        assert report.state == "confirmed"
        assert not program
        assert hold_still_by_truth(it, now())


@in_virtual_time
async def test_the_stop_of_a_group_sends_its_frame_and_one_to_each_member() -> None:
    async with rig() as it:
        await it.plant.moves.start(it.plant.group("80"), FAR)
        sent = len(it.wire.sent)
        group = it.plant.group("80")
        reports = await it.plant.stops.stop(group.members, "decelerate")
        assert it.wire.frames(sent)[:3] == ["&805SS", "&005SS", "&015SS"]
        assert [report.state for report in reports] == ["confirmed", "confirmed"]


@in_virtual_time
async def test_the_members_of_a_forgotten_group_are_stopped_nevertheless() -> None:
    async with rig() as it:
        await it.plant.moves.start(it.plant.group("80"), FAR)
        it.machine.power_off(now())
        it.machine.power_on(now())
        group = it.plant.group("80")
        reports = await it.plant.stops.stop(group.members, "immediate")
        assert [report.state for report in reports] == ["confirmed", "confirmed"]


@in_virtual_time
async def test_an_axis_of_an_interpolated_move_takes_its_group_with_it() -> None:
    async with rig() as it:
        move = Move(
            id="1",
            body_id="line1.00",
            group_id="line1.80",
            kind="interpolated",
            command="HMM",
            frame="&80HMM",
            created_at=datetime.now(UTC),
        )
        it.body("00").claim(move)
        reports = await it.plant.stops.stop([it.body("00")], "immediate")
        assert [report.body_id for report in reports] == ["line1.00", "line1.01"]


# the next frame boundary


@pytest.mark.parametrize("delay_ms", range(0, 60, 7))
@in_virtual_time
async def test_a_stop_leaves_at_the_next_frame_boundary_while_16_clients_read_flat_out(delay_ms: int) -> None:
    async with rig(baud=9600, settings=LinkSettings(reply_delay_s=0.004)) as it:
        await moving(it, "3F", "00")
        reads = (GetPosition(), GetControllerStatus(), GetEndCause(), GetSensors(), GetEncoderPosition())

        async def read_flat_out(client: int) -> None:
            body = it.plant.bodies()[client % 3]
            while True:
                await body.ask(reads[client % len(reads)])

        clients = [asyncio.create_task(read_flat_out(client)) for client in range(16)]
        await asyncio.sleep(0.5 + delay_ms / 1000)
        asked_at, boundary, sent = now(), max(now(), it.wire.tx_free_at), len(it.wire.sent)
        stopping = it.plant.stops.stop(it.plant.bodies(), "immediate")
        reports = await stopping
        frames = it.wire.sent[sent : sent + 4]
        assert [frame.frame for frame in frames] == ["&805IS", "&005IS", "&015IS", "&3F5IS"]
        assert frames[0].at == pytest.approx(boundary, abs=1e-9)
        assert frames[0].at - asked_at < 0.064
        assert frames[3].at - frames[0].at == pytest.approx(3 * 7 * it.wire.byte_time_s)
        assert all(report.state == "confirmed" for report in reports)
        for client in clients:
            client.cancel()
        await asyncio.gather(*clients, return_exceptions=True)
        last_stop = it.truth.of("command", 0x3F)
        stopped_at = next(fact.at for fact in last_stop if fact.facts["text"] == "5IS")
        assert hold_still_by_truth(it, stopped_at)


@in_virtual_time
async def test_a_stop_does_not_wait_for_a_body_that_does_not_answer() -> None:
    async with rig(bodies=(0x00, 0x3F), groups={}) as it:
        it.machine.switch_body(0x00, on=False, now=now())
        await moving(it, "3F")
        reading = asyncio.gather(it.body("00").ask(GetPosition()), return_exceptions=True)
        await asyncio.sleep(0)
        await asyncio.sleep(0.1)
        sent, asked_at = len(it.wire.sent), now()
        await it.plant.stops.stop([it.body()], "immediate")
        assert it.wire.sent[sent] == (asked_at, "&3F5IS")
        await reading


@in_virtual_time
async def test_a_link_master_that_takes_one_command_at_a_time_gets_the_stop_after_the_reply() -> None:
    settings = LinkSettings(reply_delay_s=0.05, interjection="drop")
    async with rig(settings=settings, options='stop_mode = "after_reply"') as it:
        await moving(it, "3F")
        reading = asyncio.create_task(it.body("00").ask(GetPosition()))
        await asyncio.sleep(0.01)
        asked_at, sent = now(), len(it.wire.sent)
        [report] = await it.plant.stops.stop([it.body()], "immediate")
        assert it.wire.sent[sent].frame == "&3F5IS"
        assert 0.0 < it.wire.sent[sent].at - asked_at <= 0.05
        assert it.wire.frames(sent).count("&3F5IS") == 1
        assert report.state == "confirmed"
        await reading


# repeated until confirmed


@pytest.mark.parametrize("direction", list(Direction))
@in_virtual_time
async def test_a_lost_stop_or_a_lost_reply_to_it_is_made_good(direction: Direction) -> None:
    async with rig() as it:
        await moving(it, "3F")
        it.machine.faults.set(Switch(Fault.LOST, direction, next_frames=1))
        [report] = await it.plant.stops.stop([it.body()], "immediate")
        assert report.state == "confirmed"
        assert hold_still_by_truth(it, now())
        assert "body.stop.unconfirmed" not in it.types()


@in_virtual_time
async def test_a_link_master_that_drops_interjected_stops_gets_them_again() -> None:
    async with rig(settings=LinkSettings(reply_delay_s=0.05, interjection="drop")) as it:
        await moving(it, "3F")
        reading = asyncio.create_task(it.body("00").ask(GetPosition()))
        await asyncio.sleep(0.01)
        await it.plant.stops.stop([it.body()], "immediate")
        await asyncio.sleep(1.0)  # questions are dropped, too
        assert it.types("body.stop")[-1] == "body.stop.confirmed"
        assert hold_still_by_truth(it, now())
        assert it.wire.frames().count("&3F5IS") > 1
        await reading


@pytest.mark.parametrize("mode", ["immediate", "decelerate"])
@in_virtual_time
async def test_a_motor_that_does_not_stop_is_told_again_and_people_are_told_after_two_seconds(
    mode: StopMode, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig() as it:
        await moving(it, "3F")
        execute = it.axis().execute
        deaf = ("5IS", "5SS", "UES")
        with monkeypatch.context() as patch:
            patch.setattr(
                it.axis(),
                "execute",
                lambda text, at: Response("") if text.startswith(deaf) else execute(text, at),
            )
            asked_at = now()
            [report] = await it.plant.stops.stop([it.body()], mode)
            assert now() - asked_at == pytest.approx(CONFIRM_WITHIN_S)
            assert report.state == "acknowledged"
            assert report.detail == (
                "The motor has not come to rest. Standstill is not confirmed: use the hardware stop."
            )
            assert it.types("body.stop") == ["body.stop.requested", "body.stop.unconfirmed"]
            sent = len(it.wire.sent)
            await asyncio.sleep(1.0)
            assert it.wire.frames(sent).count(f"&3F{STOP_FRAMES[mode]}") >= 5
        await asyncio.sleep(1.0)
        assert it.types("body.stop")[-1] == "body.stop.confirmed"


@in_virtual_time
async def test_a_body_that_does_not_answer_is_unconfirmed_after_two_seconds_and_told_again() -> None:
    async with rig() as it:
        await moving(it, "3F")
        it.machine.switch_body(0x3F, on=False, now=now())
        asked_at, sent = now(), len(it.wire.sent)
        [report] = await it.plant.stops.stop([it.body()], "immediate")
        assert now() - asked_at == pytest.approx(CONFIRM_WITHIN_S)
        assert report.state == "sent"
        assert "body.stop.unconfirmed" in it.types()
        await asyncio.sleep(5.0)
        assert it.wire.frames(sent).count("&3F5IS") >= 4
        [report] = await it.plant.stops.stop([it.body()], "immediate")
        assert report.state == "sent"
        assert "stands still: it cannot be asked." in (report.detail or "")


@in_virtual_time
async def test_a_stop_on_a_line_that_is_down_says_that_it_was_not_sent_and_goes_out_when_it_is_up() -> None:
    async with rig() as it:
        await moving(it, "3F")
        it.wire.unplug()
        [report] = await it.plant.stops.stop([it.body()], "immediate")
        assert report.model_dump()["state"] == "not_sent"
        it.wire.plugged_in = True
        await asyncio.sleep(10.0)
        assert report.state == "confirmed"
        assert not it.axis().motor.moving


@in_virtual_time
async def test_one_garbled_status_does_not_confirm_a_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    async with rig() as it:
        await moving(it, "3F")
        execute = it.axis().execute
        wrong = {"5IS": "", "UES0": "", "9CD0": "0"}

        def wrong_once(text: str, at: float) -> Response:
            return Response(wrong.pop(text)) if text in wrong else execute(text, at)

        monkeypatch.setattr(it.axis(), "execute", wrong_once)
        [report] = await it.plant.stops.stop([it.body()], "immediate")
        assert not wrong
        assert report.state == "confirmed"
        assert hold_still_by_truth(it, now())


@in_virtual_time
async def test_a_stop_is_never_given_up_and_no_move_begins_before_it_has_worked() -> None:
    async with rig(bodies=(0x00, 0x3F), groups={}) as it:
        await it.plant.moves.start(it.body(), MoveClockwiseSlowly(distance=900_000))
        await asyncio.sleep(1.0)
        it.wire.unplug()
        [report] = await it.plant.stops.stop([it.body()], "immediate")
        assert report.state == "not_sent"
        assert str(report.detail).startswith("Line line1 is down")
        await asyncio.sleep(2 * HURRY_S)
        assert it.axis().motor.moving
        assert it.plant.stops.under_way(it.body())
        it.wire.plugged_in = True
        await asyncio.sleep(10.0)
        assert not it.axis().motor.moving
        assert (report.state, report.detail) == ("confirmed", None)
        assert it.types("body.stop") == [
            "body.stop.requested",
            "body.stop.unconfirmed",
            "body.stop.confirmed",
        ]


@in_virtual_time
async def test_after_a_minute_a_stop_is_repeated_once_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    async with rig() as it:
        await it.plant.moves.start(it.body(), MoveClockwiseSlowly(distance=900_000))
        execute = it.axis().execute
        deaf = ("5IS", "UES")
        monkeypatch.setattr(
            it.axis(),
            "execute",
            lambda text, at: Response("") if text.startswith(deaf) else execute(text, at),
        )
        [report] = await it.plant.stops.stop([it.body()], "immediate")
        await asyncio.sleep(HURRY_S)
        sent = len(it.wire.sent)
        await asyncio.sleep(30.0)
        assert 29 <= it.wire.frames(sent).count("&3F5IS") <= 31
        with pytest.raises(Cancelled, match="not confirmed yet"):
            await it.body().ask(FAR)
        monkeypatch.undo()
        await asyncio.sleep(3.0)
        assert report.state == "confirmed"


@in_virtual_time
async def test_a_body_that_can_be_reached_again_is_stopped_within_a_second(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with rig() as it:
        await it.plant.moves.start(it.body(), MoveClockwiseSlowly(distance=900_000))
        receive = it.machine.receive

        def cut_off(data: bytes, at: float) -> None:
            if not data.startswith((b"&3F", b"&80")):
                receive(data, at)

        monkeypatch.setattr(it.machine, "receive", cut_off)
        await it.plant.stops.stop([it.body()], "immediate")
        await asyncio.sleep(3 * HURRY_S)
        assert it.axis().motor.moving
        monkeypatch.undo()
        await asyncio.sleep(1.1)
        assert not it.axis().motor.moving


@in_virtual_time
async def test_a_stop_is_repeated_while_the_line_is_fenced_for_somebody_else() -> None:
    async with rig(baud=9600) as it:
        await moving(it, "3F")
        it.machine.switch_body(0x00, on=False, now=now())
        reading = asyncio.gather(it.body("00").ask(GetPosition()), return_exceptions=True)
        await asyncio.sleep(0.6)
        assert it.plant.lines["line1"].state == "out_of_step"
        it.machine.faults.set(Switch(Fault.LOST, Direction.REQUESTS, next_frames=1))
        sent, asked_at = len(it.wire.sent), now()
        stopping = it.plant.stops.stop([it.body()], "immediate")
        await asyncio.sleep(0.6)
        assert it.plant.lines["line1"].state == "out_of_step"
        assert it.wire.frames(sent).count("&3F5IS") == 2
        stopped_at = next(fact.at for fact in it.truth.of("command", 0x3F) if fact.facts["text"] == "5IS")
        assert stopped_at - asked_at < 0.6
        [report] = await stopping
        assert report.state in ("acknowledged", "confirmed")
        await reading


@in_virtual_time
async def test_dead_bodies_that_are_stopped_take_the_line_from_nobody() -> None:
    dead, healthy = range(20), (0x20, 0x3F)
    async with rig(bodies=(*dead, *healthy), groups={}, baud=9600) as it:
        await moving(it, "3F")
        for number in dead:
            it.machine.switch_body(number, on=False, now=now())
        stopping = it.plant.stops.stop(it.plant.bodies(), "immediate")
        await stopping
        await asyncio.sleep(3 * HURRY_S)
        confirmed = [it.plant.stops.under_way(it.body(f"{number:02X}")) for number in healthy]
        assert confirmed == [False, False]
        assert it.plant.lines["line1"].state == "ready"
        asked_at = now()
        for _ in range(20):
            await it.body("20").ask(GetPosition())
        assert now() - asked_at < 2.0
        [move] = await it.plant.moves.start(it.body("20"), MoveClockwise(distance=10))
        assert (await it.plant.moves.wait(move.id, 10.0)).status == "succeeded"


@pytest.mark.parametrize("dead", [1, 2, 7])
@in_virtual_time
async def test_where_silence_holds_up_everybody_the_dead_leave_half_of_the_time(dead: int) -> None:
    settings = LinkSettings(interjection="drop")
    async with rig(
        bodies=range(8), groups={}, baud=9600, settings=settings, options='stop_mode = "after_reply"'
    ) as it:
        for number in range(dead):
            it.machine.switch_body(number, on=False, now=now())
        await it.plant.stops.stop(it.plant.bodies()[:dead], "immediate")
        for pause_s in (30.0, 2 * HURRY_S):
            await asyncio.sleep(pause_s)
            asked_at, sent = now(), len(it.wire.sent)
            for _ in range(500):
                await it.body("07").ask(GetPosition())
            assert now() - asked_at < 40.0, "alone they take 14"
            assert any("5IS" in frame for frame in it.wire.frames(sent))


@pytest.mark.parametrize("dead_for_s", [0.0, 0.2, 0.6, 1.0])
@pytest.mark.parametrize("dead", [0x00, 0x3F])
@pytest.mark.parametrize("mode", ["immediate", "decelerate"])
@in_virtual_time
async def test_one_dead_body_keeps_nobody_else_from_being_confirmed_in_time(
    mode: StopMode, dead: int, dead_for_s: float
) -> None:
    async with rig(groups={}, baud=9600) as it:
        await moving(it, "00", "01", "3F")
        it.machine.switch_body(dead, on=False, now=now())
        await asyncio.sleep(dead_for_s)
        reports = await it.plant.stops.stop(it.plant.bodies(), mode)
        silent = f"line1.{dead:02X}"
        assert [report.body_id for report in reports if report.state != "confirmed"] == [silent]
        told = [event.subject for event in it.events() if event.type.endswith("unconfirmed")]
        assert told == [f"/bodies/{silent}"]


@pytest.mark.parametrize("stop_mode", ["interject", "after_reply"])
@in_virtual_time
async def test_who_does_not_answer_the_stop_is_asked_nothing_before_the_others_are_confirmed(
    stop_mode: str,
) -> None:
    async with rig(groups={}, baud=9600, options=f'stop_mode = "{stop_mode}"') as it:
        await moving(it, "00", "01", "3F")
        it.machine.switch_body(0x3F, on=False, now=now())
        sent = len(it.wire.sent)
        stopping = it.plant.stops.stop(it.plant.bodies(), "immediate")
        await until(lambda: it.types().count("body.stop.confirmed") == 2)
        asked = [frame for frame in it.wire.frames(sent) if frame.startswith("&3F")]
        assert {frame[3:6] for frame in asked} <= {"5IS", "UES"}
        [silent] = [report for report in await stopping if report.state != "confirmed"]
        assert silent.detail == (
            "line1.3F does not answer the stop. Standstill is not confirmed: use the hardware stop."
        )
        await asyncio.sleep(10.0)
        assert not it.body("3F").online


@in_virtual_time
async def test_a_body_whose_first_stop_was_lost_gets_it_again_while_others_are_asked() -> None:
    async with rig(groups={}, baud=9600) as it:
        await moving(it, "00", "01", "3F")
        stopping = it.plant.stops.stop(it.plant.bodies(), "immediate")
        await it.wire.begun("&3F5IS")
        it.machine.faults.set(Switch(Fault.LOST, Direction.REQUESTS, next_frames=1))
        assert {report.state for report in await stopping} == {"confirmed"}
        assert not it.axis().motor.moving


@in_virtual_time
async def test_the_dead_that_come_back_are_stopped_at_once_however_many_they_were() -> None:
    settings = LinkSettings(interjection="drop")
    async with rig(
        bodies=range(8), groups={}, baud=9600, settings=settings, options='stop_mode = "after_reply"'
    ) as it:
        for number in range(7):
            it.machine.switch_body(number, on=False, now=now())
        await it.plant.stops.stop(it.plant.bodies()[:7], "immediate")
        await asyncio.sleep(2 * HURRY_S)
        sent = len(it.wire.sent)
        it.machine.switch_body(0x03, on=True, now=now())
        await until(lambda: it.body("03").online)
        online_at = now()
        await until(lambda: not it.plant.stops.under_way(it.body("03")))
        assert now() - online_at < 2.0
        assert "&035IS" in it.wire.frames(sent)


@pytest.mark.parametrize("reply_delay_s", [0.11, 0.15, 0.2, 0.3])
@in_virtual_time
async def test_controllers_that_are_slow_to_answer_have_time_to_tell_of_standstill(
    reply_delay_s: float,
) -> None:
    async with rig(settings=LinkSettings(reply_delay_s=reply_delay_s)) as it:
        await moving(it, "3F")
        sent = len(it.wire.sent)
        [report] = await it.plant.stops.stop([it.body()], "immediate")
        await until(lambda: report.state == "confirmed", 4.0)
        assert it.wire.frames(sent).count("&3F5IS") == 1
        sent = len(it.wire.sent)
        await asyncio.sleep(3.0)
        assert not {"&3F5IS", "&3FUES0"} & {*it.wire.frames(sent)}, "it would stop the next move"


@in_virtual_time
async def test_the_end_of_the_gateway_ends_the_repeating() -> None:
    async with rig() as it:
        it.machine.switch_body(0x3F, on=False, now=now())
        await it.plant.stops.stop([it.body()], "immediate")
        await it.plant.stops.close()
        await asyncio.sleep(1.0)
        sent = len(it.wire.sent)
        await asyncio.sleep(HURRY_S)
        assert "&3F5IS" not in it.wire.frames(sent)


# many, and what comes after


@in_virtual_time
async def test_a_thousand_stops_at_once_are_one() -> None:
    async with rig() as it:
        await moving(it, "3F")
        sent = len(it.wire.sent)
        stops = [it.plant.stops.stop([it.body()], "immediate") for _ in range(1000)]
        reports = await asyncio.gather(*stops)
        assert it.wire.frames(sent).count("&3F5IS") == 1
        assert all(report.state == "confirmed" for [report] in reports)
        assert it.types("body.stop") == ["body.stop.requested", "body.stop.confirmed"]


@in_virtual_time
async def test_a_stop_that_is_asked_for_again_and_again_is_confirmed_nevertheless() -> None:
    async with rig(bodies=range(8), groups={"80": ("02", "03")}, baud=9600) as it:
        readers = [asyncio.create_task(read_on(body)) for body in it.plant.bodies()]
        await moving(it, "03")
        stopping = [it.plant.stops.stop([it.body("02"), it.body("03")], "immediate")]
        for _ in range(100):
            await asyncio.sleep(0.02)
            stopping.append(it.plant.stops.stop([it.body("02"), it.body("03")], "immediate"))
        for reports in await asyncio.gather(*stopping):
            assert [report.state for report in reports] == ["confirmed", "confirmed"]
        assert "body.stop.unconfirmed" not in it.types()
        for reader in readers:
            reader.cancel()


async def read_on(body: Body) -> None:
    """Read without a pause."""
    while True:
        with suppress(GatewayError):
            await body.ask(GetPosition())


@in_virtual_time
async def test_a_second_stop_later_is_a_stop_of_its_own() -> None:
    async with rig() as it:
        await it.plant.stops.stop([it.body()], "immediate")
        await moving(it, "3F")
        sent = len(it.wire.sent)
        [report] = await it.plant.stops.stop([it.body()], "immediate")
        assert it.wire.frames(sent)[0] == "&3F5IS"
        assert report.state == "confirmed"
        assert not it.axis().motor.moving


@in_virtual_time
async def test_a_stop_that_still_waits_when_standstill_is_proved_does_not_stop_the_next_move() -> None:
    settings = LinkSettings(reply_delay_s=0.15, interjection="drop")
    async with rig(settings=settings, options='stop_mode = "after_reply"') as it:
        await moving(it, "3F")
        it.machine.faults.set(Switch(Fault.LOST, Direction.REPLIES, next_frames=3))
        stopping = it.plant.stops.stop([it.body()], "immediate")
        await until(lambda: "body.stop.confirmed" in it.types())
        assert it.plant.line("line1").waiting()["stop_repeat"] == 0
        await stopping


@in_virtual_time
async def test_no_move_starts_until_the_stop_is_confirmed() -> None:
    async with rig() as it:
        moves = await moving(it, "3F", "00")
        asked_at = now()
        stopping = it.plant.stops.stop([it.body("00"), it.body()], "immediate")
        for target in (it.body(), it.plant.group("80")):
            with pytest.raises(GatewayError):
                await it.plant.moves.start(target, FAR)
        await stopping
        assert hold_still_by_truth(it, asked_at)
        for move in moves:
            await it.plant.moves.wait(move.id, 10.0)
        [move] = await it.plant.moves.start(it.body(), MoveClockwise(distance=10))
        assert (await it.plant.moves.wait(move.id, 10.0)).status == "succeeded"


@in_virtual_time
async def test_a_foreign_motion_is_stopped_and_a_move_in_the_meantime_is_cancelled() -> None:
    async with rig(settings=LinkSettings(reply_delay_s=0.02)) as it:
        it.axis().execute("1+MZ", now())
        stopping = it.plant.stops.stop([it.body()], "immediate")
        with pytest.raises(Cancelled, match="not confirmed yet"):
            await it.plant.moves.start(it.body(), FAR)
        [report] = await stopping
        assert report.state == "confirmed"
        assert not it.axis().motor.moving


# a long ramp


SLOW_RAMP = SetMaximumAcceleration(acceleration=20_000)
"""Acceleration with which the standard set comes to rest from 50,000 pps in 5 s."""


async def at_full_speed(rig: Rig, *addresses: str) -> None:
    """Set bodies moving that ramp for 5 s, and let them come up to speed."""
    for address in addresses:
        await rig.body(address).ask(SLOW_RAMP)
        await rig.plant.moves.start(rig.body(address), FAR)
    await asyncio.sleep(6.0)


@pytest.mark.parametrize("baud", [None, 9600])
@in_virtual_time
async def test_a_motor_on_a_long_ramp_raises_no_alarm_and_says_how_long_it_may_take(
    baud: int | None,
) -> None:
    async with rig(baud=baud) as it:
        await at_full_speed(it, "3F")
        asked_at = now()
        [report] = await it.plant.stops.stop([it.body()], "decelerate")
        assert report.state == "acknowledged"
        assert str(report.detail).endswith("settings it may take up to 5.0 s to come to rest.")
        await it.plant.stops.confirmed()
        assert 4.0 < now() - asked_at < 5.5
        assert it.types("body.stop") == ["body.stop.requested", "body.stop.confirmed"]


@in_virtual_time
async def test_the_ramp_is_that_of_the_speed_set_of_stops() -> None:
    async with rig() as it:
        slow = {"speed_set": 7}
        for command in (
            SetStartSpeed(speed=50, **slow),
            SetMaximumSpeed(speed=10_000, **slow),
            SetMaximumAcceleration(acceleration=10_000, **slow),
            SetRisingAccelerationShare(percent=0, **slow),
            SetFallingAccelerationShare(percent=0, **slow),
            SetStopSpeedSet(speed_set=7),
        ):
            await it.body().ask(command)
        await moving(it, "3F")
        await asyncio.sleep(1.0)
        [report] = await it.plant.stops.stop([it.body()], "decelerate")
        assert "it may take up to 5.0 s" in str(report.detail), "from the move's 50,000 pps"
        await asyncio.sleep(4.0)
        assert it.types("body.stop") == ["body.stop.requested", "body.stop.confirmed"]


@in_virtual_time
async def test_a_motor_that_runs_on_after_its_ramp_is_an_alarm(monkeypatch: pytest.MonkeyPatch) -> None:
    async with rig() as it:
        await at_full_speed(it, "3F")
        execute = it.axis().execute
        deaf = ("5SS", "UES")
        monkeypatch.setattr(
            it.axis(),
            "execute",
            lambda text, at: Response("") if text.startswith(deaf) else execute(text, at),
        )
        sent = len(it.wire.sent)
        it.plant.stops.stop([it.body()], "decelerate")
        await asyncio.sleep(5.0 + PROVED_WITHIN_S - 0.1)
        assert it.types("body.stop") == ["body.stop.requested"]
        assert 3 <= it.wire.frames(sent).count("&3F5SS") <= 6, "it is told now and then"
        await asyncio.sleep(0.3)
        assert it.types("body.stop") == ["body.stop.requested", "body.stop.unconfirmed"]


@in_virtual_time
async def test_a_body_that_falls_silent_on_its_ramp_is_an_alarm_as_soon_as_that_is_known() -> None:
    async with rig() as it:
        await at_full_speed(it, "3F")
        it.plant.stops.stop([it.body()], "decelerate")
        await asyncio.sleep(3.0)
        assert it.types("body.stop") == ["body.stop.requested"]
        it.machine.switch_body(0x3F, on=False, now=now())
        await asyncio.sleep(1.5)
        assert it.types("body.stop") == ["body.stop.requested", "body.stop.unconfirmed"]


@in_virtual_time
async def test_a_body_that_is_silent_from_the_stop_on_is_an_alarm_after_two_seconds() -> None:
    async with rig() as it:
        await at_full_speed(it, "3F")
        it.machine.switch_body(0x3F, on=False, now=now())
        it.plant.stops.stop([it.body()], "decelerate")
        await asyncio.sleep(CONFIRM_WITHIN_S + 0.05)
        assert it.types("body.stop") == ["body.stop.requested", "body.stop.unconfirmed"]


@in_virtual_time
async def test_the_members_of_a_group_are_given_their_ramps_at_9600_baud() -> None:
    bodies = range(16)
    async with rig(bodies=tuple(bodies), groups={}, baud=9600) as it:
        await at_full_speed(it, *(f"{number:02X}" for number in bodies))
        it.plant.stops.stop(it.plant.bodies(), "decelerate")
        await it.plant.stops.confirmed()
        assert "body.stop.unconfirmed" not in it.types("body.stop")


@in_virtual_time
async def test_a_line_that_falls_silent_while_motors_ramp_is_an_alarm_as_soon_as_that_is_known() -> None:
    async with rig() as it:
        await at_full_speed(it, "3F")
        it.plant.stops.stop([it.body()], "decelerate")
        await asyncio.sleep(3.0)
        it.wire.deaf_to = re.compile(rb"[^\r]*\r")
        await asyncio.sleep(1.5)
        assert it.types("body.stop") == ["body.stop.requested", "body.stop.unconfirmed"]
        it.wire.deaf_to = None
        await it.plant.stops.confirmed()
