import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.core.errors import (
    BodyOffline,
    Cancelled,
    Expired,
    GarbledReply,
    GatewayError,
    NoReply,
    PortNotOpen,
    QueueFull,
)
from gateway.core.exchange import QUEUE_LIMIT, Lane
from gateway.core.fence import FENCE_TRIES
from gateway.core.line import ORDER_TOLD_S, REOPEN_S, SILENCE_S
from gateway.core.scheduler import TURN_S, Scheduler
from gateway.rorze.line import WRITTEN_WITHIN_S, Line, LineState, lane_of
from gateway.rorze.session import READ_REPEATS, STRICT_S, Answered, Outcome, RorzeExchange
from protocols.rorze.link import Frame, MoveEnded, Refusal, StatusChanged, UnknownMessage
from protocols.rorze.link_master import SetGroup
from protocols.rorze.moves import MoveClockwise, MoveCounterclockwise, MoveTo
from protocols.rorze.notation import PositionReference
from protocols.rorze.origin import GetOverrunFactor, SetOverrunFactor
from protocols.rorze.position import GetPosition, SignedPulses
from protocols.rorze.position_table import GetPositionEntry, SetPositionEntry
from protocols.rorze.row import LINK_MASTER, RorzeCommand
from protocols.rorze.status import GetControllerStatus
from protocols.rorze.stops import StopDecelerating, StopImmediately
from tests.gateway.rorze.far_end import LATENCY_S, SET_UP_FRAMES, FarEnd, running_line, until, virtual
from tests.virtual_time import run_virtual
from transports.base import STUCK_S

REPLY_TIMEOUT_S, LATE_REPLY_S = 0.5, 2.0

MOVE = MoveClockwise(distance=500)
MOVE_FRAME = "&021+M500"
READ = GetPosition()
READ_FRAME = "&026PD"


def ask(line: Line, command: RorzeCommand[Any], body: int = 2, **more: Any) -> "asyncio.Future[Outcome]":
    return line.submit(body, command, lane_of(command), **more)


def pulses(outcome: Outcome, body: int = 2) -> int:
    assert isinstance(outcome, Answered), outcome
    reply = outcome.replies[body]
    assert isinstance(reply, SignedPulses)
    return reply.pulses


# opening


@virtual
async def test_an_opening_poisons_what_was_left_half_sent_and_then_tells_the_link_master_everything() -> None:
    far = FarEnd()
    line = Line("line1", far, [2, 3], {0x80: [2, 3]})
    changes: list[str] = []
    line.on_change = lambda what, _: changes.append(what)
    line.start()
    await until(lambda: line.state is LineState.SETTING_UP)
    early = ask(line, MOVE)
    assert isinstance(await early, Answered)
    assert far.frames == [*SET_UP_FRAMES, "&7FXVS80,02,03", MOVE_FRAME]
    assert far.frames[0] == "!" * 61
    assert (line.state, line.controllers, changes) == (LineState.READY, "02,03", ["line.up"])
    await line.close()
    assert changes == ["line.up", "line.down"]


@virtual
async def test_after_the_poison_the_line_must_have_been_silent_before_anything_is_said() -> None:
    far = FarEnd()
    line = Line("line1", far, [2])
    line.start()
    await until(lambda: far.written)
    for after_s in (0.02, 0.04, 0.06):
        far.say(b"rest of an old reply\r", after_s)
    last_said_at = asyncio.get_running_loop().time() + 0.06
    await until(lambda: line.state is LineState.READY)
    assert far.times_of("&7FXID") == [pytest.approx(last_said_at + SILENCE_S)]
    await line.close()


@virtual
async def test_a_line_that_is_never_silent_is_set_up_nevertheless() -> None:
    far = FarEnd()
    line = Line("line1", far, [2], late_reply_s=0.3)
    line.start()
    await until(lambda: far.written)
    for beat in range(200):
        far.say(b"\xff", beat * 0.03)
    await until(lambda: "&7FXID" in far.frames, within_s=1)
    await line.close()


@virtual
async def test_an_answer_to_the_set_up_that_is_lost_is_asked_for_again() -> None:
    far = FarEnd()
    far.once("&7FXID")
    line = Line("line1", far, [2, 3])
    line.start()
    await until(lambda: line.state is LineState.READY)
    assert far.frames == [SET_UP_FRAMES[0], "&7FXID", "fence 02", "&7FXID", "&7FXRSM1"]
    await line.close()


@pytest.mark.parametrize("introducer", ["$", "#"])
def test_a_line_with_the_old_form_still_reaches_the_link_master(introducer: str) -> None:
    async def story() -> None:
        far = FarEnd()
        async with running_line(far, [2], introducer=introducer) as line:
            far.once(f"{introducer}26PD", (0.01, f">{introducer}26PD+000000007"))
            far.silent.clear()
            assert pulses(await ask(line, READ)) == 7

    run_virtual(story())


@virtual
async def test_a_group_that_is_defined_now_is_defined_again_after_a_restart_of_the_link_master() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        await line.define_group(0x80, [3, 2])
        line.set_up_again("test")
        await until(lambda: far.frames[1:] == ["fence 02", "&7FXID", "&7FXRSM1", "&7FXVS80,03,02"])


@virtual
async def test_a_refused_group_leaves_the_old_one() -> None:
    far = FarEnd()
    async with running_line(far, groups={0x80: [2, 3]}) as line:
        far.once("&7FXVS80,03,02", (0.01, ">&7FXVS@4A"))
        with pytest.raises(GatewayError):
            await line.define_group(0x80, [3, 2])
        assert line.groups == {0x80: [2, 3]}


@virtual
async def test_when_nobody_knows_whether_a_group_was_taken_the_old_one_is_sent_again() -> None:
    far = FarEnd()
    async with running_line(far, groups={0x80: [2, 3]}) as line:
        far.once("&7FXVS80,03,02")
        with pytest.raises(NoReply):
            await line.define_group(0x80, [3, 2])
        await until(lambda: far.frames[-1] == "&7FXVS80,02,03")


# one exchange under way, and the exchange that a reply belongs to


@virtual
async def test_one_exchange_is_under_way_at_a_time() -> None:
    far = FarEnd()
    async with running_line(far, range(6)) as line:
        await asyncio.gather(*(ask(line, MOVE, body) for body in range(6)))
        times = [at for at, _ in far.written]
        assert len(times) == 6
        for earlier, later in pairwise(times):
            assert later >= earlier + LATENCY_S


class TerminalServer(FarEnd):
    """Passes on what it takes at a speed of its own."""

    is_bridged = True


@virtual
async def test_behind_a_terminal_server_frames_that_follow_unanswered_ones_are_spaced() -> None:
    far = TerminalServer()
    async with running_line(far, range(6), port_baud=19200) as line:
        begun_at = len(far.written)
        await asyncio.gather(*(ask(line, MOVE, body) for body in range(3)))
        await asyncio.gather(*(line.submit(body, StopImmediately(), Lane.STOP) for body in range(6)))
        times = [at for at, _ in far.written[begun_at:]]
        gaps = [later - earlier for earlier, later in pairwise(times)]
        assert gaps == pytest.approx([LATENCY_S] * 3 + [len("&025IS\r") * 10 / 19200] * 5, abs=1e-4)


@pytest.mark.parametrize(
    "wrong",
    [
        ">&031+M",  # another body
        ">&021-M",  # another code
        ">&021+M5",  # more than the acknowledgement
        ">&801+M",  # a group
        ">&021+M@4",  # an error code cut short
        "&021+M500",  # an echo
        "&021+M",  # the first character lost
        "nonsense",
    ],
)
def test_a_reply_is_credited_only_if_body_code_and_the_whole_grammar_are_right(wrong: str) -> None:
    async def story() -> None:
        far = FarEnd()
        async with running_line(far) as line:
            far.once(MOVE_FRAME, (0.01, wrong))
            outcome = await ask(line, MOVE)
            assert isinstance(outcome, GarbledReply)
            assert outcome.moved == "unknown"
            assert far.frames == [MOVE_FRAME, "fence 02"]

    run_virtual(story())


@pytest.mark.parametrize(
    "wrong", ["+1", "+00000000", "+0000000000", "000000005", "H00000005", "", "+00000000x"]
)
def test_a_number_without_its_printed_width_is_no_position(wrong: str) -> None:
    async def story() -> None:
        far = FarEnd()
        async with running_line(far) as line:
            far.once(READ_FRAME, (0.01, f">{READ_FRAME}{wrong}"))
            far.once(READ_FRAME, (0.01, f">{READ_FRAME}+000000042"))
            assert pulses(await ask(line, READ)) == 42
            assert far.frames == [READ_FRAME, "fence 02", READ_FRAME]

    run_virtual(story())


@pytest.mark.parametrize(("said", "error"), [("@50", 0x50), ("@", None), ("@FF", 0xFF)])
def test_a_refusal_is_told_with_its_code_if_there_is_one(said: str, error: int | None) -> None:
    async def story() -> None:
        far = FarEnd()
        async with running_line(far) as line:
            far.once(MOVE_FRAME, (0.01, f">&021+M{said}"))
            assert await ask(line, MOVE) == Refusal(2, "1+M", error)
            assert far.frames == [MOVE_FRAME]

    run_virtual(story())


@virtual
async def test_messages_nobody_asked_for_never_complete_an_exchange_and_are_passed_on() -> None:
    far = FarEnd()
    heard: list[Frame] = []
    async with running_line(far) as line:
        line.on_message = heard.append
        messages = [">&7D1+M[02:00]", ">&7EXED[02:M:H01]", ">&7CUSD[02:hello]", ">&7A1+M", ">&9FXXX"]
        far.once(MOVE_FRAME, *((0.01, message) for message in messages), (0.02, ">&021+M"))
        outcome = await ask(line, MOVE)
        assert isinstance(outcome, Answered)
        assert not outcome.late
        assert far.frames == [MOVE_FRAME]
    ended, changed, *unknown = heard
    assert ended == MoveEnded(2, "1+M", 0)
    assert isinstance(changed, StatusChanged)
    assert [it.text for it in unknown if isinstance(it, UnknownMessage)] == messages[2:]


@virtual
async def test_a_group_reply_gives_each_member_its_own_and_the_missing_member_nothing() -> None:
    far = FarEnd()
    async with running_line(far, groups={0x80: [2, 3, 4]}) as line:
        far.once("&809CD", (0.01, ">&809CD@[02:H00][03:@4A]"))
        outcome = await ask(line, GetControllerStatus(), 0x80)
        assert isinstance(outcome, Answered)
        assert set(outcome.replies) == {2, 3}
        assert outcome.replies[3] == Refusal(3, "9CD", 0x4A)


@virtual
async def test_equal_reads_that_wait_share_one_trip_on_the_wire() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        first = ask(line, GetControllerStatus(), 3)
        far.once(READ_FRAME, (0.01, f">{READ_FRAME}+000000009"))
        waiting = [ask(line, READ) for _ in range(5)]
        _, *outcomes = await asyncio.gather(first, *waiting)
        assert far.frames == ["&039CD", READ_FRAME]
        assert {pulses(outcome) for outcome in outcomes} == {9}
        assert {outcome.at for outcome in outcomes if isinstance(outcome, Answered)} == {
            far.times_of(READ_FRAME)[0] + 0.01
        }


@virtual
async def test_a_read_that_nobody_waits_for_any_more_is_not_sent_but_a_move_is() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        first = ask(line, GetControllerStatus(), 3)
        ask(line, READ).cancel()
        ask(line, MOVE).cancel()
        last = ask(line, GetOverrunFactor())
        await asyncio.gather(first, last)
        assert far.frames == ["&039CD", MOVE_FRAME, "&020BD"]


# no reply, late reply, fence


@virtual
async def test_after_a_timeout_nothing_is_sent_before_a_fence_has_passed() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.once(MOVE_FRAME)
        lost = ask(line, MOVE)
        other = ask(line, MOVE, 3)
        outcome = await lost
        assert isinstance(outcome, NoReply)
        assert not isinstance(outcome, GarbledReply)
        assert isinstance(await other, Answered)
        assert far.frames == [MOVE_FRAME, "fence 02", "&031+M500"]
        sent_at, fence_at, other_at = (at for at, _ in far.written)
        assert fence_at == pytest.approx(sent_at + REPLY_TIMEOUT_S)
        assert other_at == pytest.approx(fence_at + LATENCY_S)


@virtual
async def test_a_late_reply_before_the_fence_belongs_to_the_old_command() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.once(MOVE_FRAME, (0.9, ">&021+M"))
        far.once(MOVE_FRAME, (0.02, ">&021+M@50"))
        late = ask(line, MOVE)
        following = ask(line, MOVE)
        outcome = await late
        assert isinstance(outcome, Answered)
        assert outcome.late
        assert await following == Refusal(2, "1+M", 0x50)
        assert far.frames == [MOVE_FRAME, "fence 02", MOVE_FRAME]
        assert line.counters["late_replies"] == 1


@virtual
async def test_a_late_refusal_is_a_refusal() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.once(MOVE_FRAME, (0.9, ">&021+M@51"))
        assert await ask(line, MOVE) == Refusal(2, "1+M", 0x51)


@virtual
async def test_a_late_reply_after_the_fence_is_dropped_and_counted() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.once(MOVE_FRAME)
        assert isinstance(await ask(line, MOVE), NoReply)
        far.say(">&021+M")
        await asyncio.sleep(0.01)
        assert line.counters["strays"] == 1
        assert isinstance(await ask(line, MoveCounterclockwise(distance=1)), Answered)


@virtual
async def test_a_reply_that_its_fence_has_overtaken_is_told_as_out_of_order() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        changes: list[tuple[str, dict[str, object]]] = []
        line.on_change = lambda what, facts: changes.append((what, facts))
        far.once(MOVE_FRAME)
        assert isinstance(await ask(line, MOVE), NoReply)
        far.say(">&021+M")
        await asyncio.sleep(0.01)
        late = {"late": "move-clockwise of line1.02", "before": "get-numbered-position-entry of line1.02"}
        assert changes == [("line.order.violated", late)]
        assert line.counters["overtaken"] == 1


@virtual
async def test_a_copy_of_the_next_reply_of_that_name_is_no_reply_out_of_order() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.once(MOVE_FRAME)
        assert isinstance(await ask(line, MOVE), NoReply)
        far.once(MOVE_FRAME, (0.01, ">&021+M"), (0.02, ">&021+M"))
        assert isinstance(await ask(line, MOVE), Answered)
        await asyncio.sleep(0.1)
        assert line.counters["duplicates"] == 1
        assert line.counters["overtaken"] == 0


@virtual
async def test_replies_out_of_order_are_counted_and_told_once_an_hour() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        changes: list[str] = []
        line.on_change = lambda what, _: changes.append(what)

        async def overtake() -> None:
            far.once(MOVE_FRAME)
            await ask(line, MOVE)
            far.say(">&021+M")
            await asyncio.sleep(1.0)

        await overtake()
        await overtake()
        assert (line.counters["overtaken"], changes) == (2, ["line.order.violated"])
        await asyncio.sleep(ORDER_TOLD_S)
        await overtake()
        assert (line.counters["overtaken"], changes) == (3, 2 * ["line.order.violated"])


@virtual
async def test_a_garbled_reply_calls_for_the_fence_at_once() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.once(MOVE_FRAME, (0.01, b">&0#1+M\r"))
        await ask(line, MOVE)
        (sent_at, _), (fence_at, _) = far.written
        assert fence_at == pytest.approx(sent_at + 0.01)


@pytest.mark.parametrize(
    ("garbage", "what"),
    [
        (b">&0#1+M\r", "something that is no reply"),
        (b"\xff\x80noise\r", "something that is no reply"),
        (b"&021+M500\r", "an echo of our own command"),
        (b">&021+M@5\r", "a malformed error code"),
        (b">&036PD\r", "the reply to another command"),
        (b"x" * 5000 + b"\r", "a line too long for a reply"),
    ],
)
def test_what_came_back_instead_of_a_reply_is_said_in_a_sentence(garbage: bytes, what: str) -> None:
    @virtual
    async def story() -> None:
        far = FarEnd()
        async with running_line(far) as line:
            far.once(MOVE_FRAME, (0.01, garbage))
            outcome = await ask(line, MOVE)
            assert isinstance(outcome, NoReply)
            assert outcome.detail == f"1+M was sent to body 02, and {what} came back."

    story()


@virtual
async def test_a_doubled_reply_is_never_taken_for_the_next_one() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.once(MOVE_FRAME, (0.01, ">&021+M"), (0.05, ">&021+M"))
        far.once(MOVE_FRAME, (0.1, ">&021+M@50"))
        first, second = ask(line, MOVE), ask(line, MOVE)
        assert isinstance(await first, Answered)
        assert await second == Refusal(2, "1+M", 0x50)
        assert line.counters["duplicates"] == 1


@virtual
async def test_a_reply_that_comes_in_pieces_is_waited_for_but_not_for_ever() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.once(READ_FRAME, (0.48, b">&026PD"), (0.55, b"+0000"), (0.62, b"00001\r"))
        assert pulses(await ask(line, READ)) == 1
        assert far.frames == [READ_FRAME]
        drips = [(0.09 * beat, b"x") for beat in range(1, 200)]
        far.once(MOVE_FRAME, *drips)
        outcome = asyncio.ensure_future(ask(line, MOVE))
        sent_at = far.times_of(MOVE_FRAME)[0]
        await until(lambda: far.frames[-1] == "fence 02", within_s=4)
        fence_at = far.times_of("fence 02")[0]
        assert fence_at <= sent_at + REPLY_TIMEOUT_S + LATE_REPLY_S + 1e-6
        outcome.cancel()


@virtual
async def test_a_read_is_repeated_twice_at_most_and_each_time_after_a_fence() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        for _ in range(1 + READ_REPEATS):
            far.once(READ_FRAME)
        assert isinstance(await ask(line, READ), NoReply)
        assert far.frames == [READ_FRAME, "fence 02"] * 3


@pytest.mark.parametrize(
    "command",
    [
        MOVE,
        MoveTo(position=0),
        SetOverrunFactor(factor=2),
        GetPositionEntry(entry=PositionReference(position="next")),
    ],
    ids=lambda it: it.code,
)
def test_what_moves_sets_or_steps_is_written_once(command: RorzeCommand[Any]) -> None:
    async def story() -> None:
        far = FarEnd()
        async with running_line(far) as line:
            frame = f"&02{command.code}{command.written()}"
            far.once(frame)
            assert isinstance(await ask(line, command), NoReply)
            await asyncio.sleep(30)
            assert far.frames == [frame, "fence 02"]

    run_virtual(story())


@virtual
async def test_noise_does_not_use_up_the_tries_of_a_fence() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.once(MOVE_FRAME, (0.01, b"noise\r" * 50), (0.015, b"noise\r" * 50))
        assert isinstance(await ask(line, MOVE), GarbledReply)
        assert far.frames == [MOVE_FRAME, "fence 02"]
        assert not line.offline
        assert line.counters["garbage"] == 100


@virtual
async def test_a_late_reply_to_the_first_fence_does_not_spoil_the_second() -> None:
    far = FarEnd()
    async with running_line(far, reply_timeout_s=0.2, late_reply_s=0.6) as line:
        far.once(MOVE_FRAME)
        future = ask(line, MOVE)
        await until(lambda: far.frames[-1] == "fence 02")
        first_fence = far.written[-1][1]
        far.once("fence 02")
        far.say(f">{first_fence[:6]}P[0000],+000000000", 0.3)
        assert isinstance(await future, NoReply)
        assert not line.offline
        assert len(far.times_of("fence 02")) <= FENCE_TRIES


@virtual
async def test_a_refused_fence_has_not_passed() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.once(MOVE_FRAME)
        far.once("fence 02", (0.01, ">&023ND@4B"))
        assert isinstance(await ask(line, MOVE), NoReply)
        assert far.frames == [MOVE_FRAME, "fence 02", "fence 02"]
        assert not line.offline


@virtual
async def test_no_two_fences_ask_for_the_same_number() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        for _ in range(50):
            await ask(line, MOVE)
        fences = [frame for _, frame in far.written if "3ND" in frame]
        assert len(set(fences)) == len(fences) == 49


@virtual
async def test_a_flood_without_an_end_costs_one_exchange_and_no_memory() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.once(MOVE_FRAME, *((0.01, b"\xa5" * 65536) for _ in range(16)))
        outcome = asyncio.ensure_future(ask(line, MOVE))
        await until(lambda: line.counters["garbage"])
        far.say(b"\r")
        assert isinstance(await outcome, GarbledReply)
        assert pulses(await ask(line, READ)) == 0
        assert line._reader.pending() == 0


# presence


@virtual
async def test_a_body_that_fails_three_fences_is_offline_and_the_others_go_on() -> None:
    far = FarEnd()
    changes: list[tuple[str, dict[str, object]]] = []
    async with running_line(far) as line:
        line.on_change = lambda what, facts: changes.append((what, facts))
        far.silent = {2}
        lost, waiting = ask(line, READ), ask(line, MOVE)
        other = ask(line, READ, 3)
        assert isinstance(await waiting, BodyOffline)
        assert isinstance(await lost, NoReply)
        assert isinstance(await other, Answered)
        assert far.frames == [MOVE_FRAME, *["fence 02"] * 3, "fence 03", "&036PD"] or far.frames == [
            READ_FRAME,
            *["fence 02"] * 3,
            "fence 03",
            "&036PD",
        ]
        assert changes == [("body.offline", {"body": 2, "asked": True})]
        with pytest.raises(BodyOffline):
            ask(line, READ)
        assert line.state is LineState.READY


@virtual
async def test_a_body_that_is_back_is_found_by_the_probes() -> None:
    far = FarEnd()
    changes: list[str] = []
    async with running_line(far) as line:
        line.on_change = lambda what, _: changes.append(what)
        far.silent = {2}
        await ask(line, READ)
        assert line.offline == {2}
        far.silent = set()
        await until(lambda: not line.offline)
        assert changes == ["body.offline", "body.online"]
        assert pulses(await ask(line, READ)) == 0
        assert "&7FXID" not in far.frames


@virtual
async def test_a_body_that_is_absent_for_good_does_not_keep_another_from_being_found() -> None:
    far = FarEnd()
    async with running_line(far, bodies=[1, 2, 3]) as line:
        far.silent = {1}
        await line.submit(1, READ, Lane.READ)
        await asyncio.sleep(60)
        far.silent = {1, 2}
        await line.submit(2, READ, Lane.READ)
        assert line.offline == {1, 2}
        far.silent = {1}
        back_at = asyncio.get_running_loop().time()
        await until(lambda: line.offline == {1})
        assert asyncio.get_running_loop().time() - back_at < 2


@virtual
async def test_probes_of_a_dead_body_become_rarer() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.silent = {2}
        await ask(line, READ)
        died_at = asyncio.get_running_loop().time()
        await asyncio.sleep(100)
        probes = [at for at in far.times_of("fence 02") if at > died_at]
        pauses = [later - earlier for earlier, later in pairwise(probes)]
        assert pauses == sorted(pauses)
        assert pauses[-1] > 9
        assert len(probes) < 16


@virtual
async def test_when_the_whole_line_was_silent_the_link_master_is_set_up_again() -> None:
    far = FarEnd()
    async with running_line(far, groups={0x80: [2, 3]}) as line:
        far.silent = {2, 3, LINK_MASTER}
        outcomes = await asyncio.gather(ask(line, READ), ask(line, READ, 3))
        assert all(isinstance(it, NoReply | BodyOffline) for it in outcomes)
        assert line.offline == {2, 3}
        await until(lambda: line.state is LineState.SILENT)
        far.silent = set()
        far.written.clear()
        await until(lambda: not line.offline)
        await until(lambda: line.state is LineState.READY)
        set_up = [frame for frame in far.frames if frame.startswith("&7F")]
        assert set_up == ["&7FXID", "&7FXRSM1", "&7FXVS80,02,03"]


@virtual
async def test_nothing_is_repeated_when_nobody_is_left_to_prove_that_the_line_is_in_step() -> None:
    far = FarEnd()
    far.silent = {2, 3, LINK_MASTER}
    line = Line("line1", far, [2, 3])
    line.start()
    await until(lambda: line.state is LineState.SILENT)
    assert line.offline == {2, 3}
    assert far.frames.count("&7FXID") == 1
    assert "&7FXRSM1" not in far.frames
    await line.close()


# silence of all


@asynccontextmanager
async def started(far: FarEnd, bodies: tuple[int, ...] = (2, 3)) -> AsyncIterator[tuple[Line, list[str]]]:
    """A line that is not waited for, and what it tells of itself."""
    line = Line("line1", far, bodies)
    news: list[str] = []
    line.on_change = lambda what, _: news.append(what) if what.startswith("line.") else None
    line.start()
    yield line, news
    await line.close()


@virtual
async def test_a_line_on_which_nobody_has_ever_answered_is_silent_and_says_what_to_check(
    caplog: pytest.LogCaptureFixture,
) -> None:
    far = FarEnd()
    far.silent = {2, 3, LINK_MASTER}
    async with started(far) as (line, news):
        await asyncio.sleep(60)
        assert line.state is LineState.SILENT
        assert line.trouble is not None
        for cause in ("cable", "power", "baud rate", "rotary switch"):
            assert cause in line.trouble
        assert caplog.text.count("line line1 is silent") == 1
        with pytest.raises(BodyOffline):
            ask(line, READ)
        assert isinstance(await ask(line, StopImmediately()), NoReply), "a stop is sent nevertheless"
        assert news == []
        far.silent = set()
        await until(lambda: line.state is LineState.READY, within_s=3)
        assert line.trouble is None
        assert news == ["line.up"]
        await until(lambda: not line.offline)
        assert pulses(await ask(line, READ)) == 0
    assert news == ["line.up", "line.down"]


@virtual
async def test_a_line_that_answers_in_garbage_says_so() -> None:
    far = FarEnd()
    for _ in range(20):
        far.once("&7FXID", (0.01, b"\xf8\x80\xf8\r"))
    far.silent = {2, 3}
    async with started(far) as (line, _):
        await until(lambda: line.state is LineState.SILENT)
        assert "what comes back is no reply" in (line.trouble or "")


@virtual
async def test_the_last_body_to_fall_silent_takes_the_line_down_and_the_first_back_brings_it_up() -> None:
    far = FarEnd()
    async with started(far) as (line, news):
        await until(lambda: line.state is LineState.READY)
        far.silent = {2}
        await ask(line, READ)
        assert line.state is LineState.READY
        far.silent = {2, 3}
        await ask(line, READ, 3)
        await until(lambda: line.state is LineState.SILENT)
        assert "the RC-400 answers, and none of its bodies does" in (line.trouble or "")
        assert news == ["line.up", "line.down"]
        far.silent = {2}
        await until(lambda: line.state is LineState.READY, within_s=5)
        assert line.offline == {2}
        assert news == ["line.up", "line.down", "line.up"]


@virtual
async def test_a_link_master_that_does_not_answer_is_told_and_its_bodies_are_served(
    caplog: pytest.LogCaptureFixture,
) -> None:
    far = FarEnd()
    far.silent = {LINK_MASTER}
    async with started(far) as (line, news):
        await until(lambda: line.state is LineState.READY)
        assert "does not answer XID" in caplog.text
        assert news == ["line.up"]
        assert line.controllers == ""
        assert isinstance(await ask(line, MOVE), Answered)


@virtual
async def test_a_line_without_bodies_is_up_when_its_link_master_answers() -> None:
    far = FarEnd()
    far.silent = {LINK_MASTER, 0}
    async with started(far, bodies=()) as (line, news):
        await until(lambda: line.state is LineState.SILENT)
        far.silent = {0}
        await until(lambda: line.state is LineState.READY)
        assert news == ["line.up"]


@virtual
async def test_a_line_that_is_set_up_again_was_up_all_the_time() -> None:
    far = FarEnd()
    async with started(far) as (line, news):
        await until(lambda: line.state is LineState.READY)
        for _ in range(3):
            line.set_up_again("test")
            await asyncio.sleep(5)
        assert news == ["line.up"]
        assert far.frames.count("&7FXID") == 4


@virtual
async def test_a_stop_is_sent_to_a_body_that_is_offline_and_its_answer_brings_it_back() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.silent = {2}
        await ask(line, READ)
        far.silent = set()
        assert isinstance(await ask(line, StopImmediately()), Answered)
        assert not line.offline


# when the line last erred


@virtual
async def test_a_missing_a_garbled_and_a_doubled_reply_are_errors_of_the_line_and_so_is_a_lost_port() -> None:
    far = FarEnd()
    answered = (0.01, f">{READ_FRAME}+000000001")
    async with running_line(far) as line:
        assert line.last_error_at is None
        for replies in ((), ((0.01, "noise"), answered), (answered, (0.011, answered[1]))):
            before = asyncio.get_running_loop().time()
            far.once(READ_FRAME, *replies)
            await ask(line, READ)
            await asyncio.sleep(0.1)
            assert line.last_error_at is not None
            assert line.last_error_at > before
        far.once(READ_FRAME)
        lost = ask(line, READ)
        await asyncio.sleep(0.1)
        unplugged_at = asyncio.get_running_loop().time()
        far.unplug()
        await lost
        assert line.last_error_at == unplugged_at


@virtual
async def test_the_silence_of_those_who_are_known_to_be_absent_is_no_error_of_the_line() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.silent = {2, 0x44}
        await ask(line, READ)
        assert line.offline == {2}
        erred_at = line.last_error_at
        assert erred_at is not None
        assert isinstance(await line.probe(0x44, 0.1), NoReply)
        assert isinstance(await ask(line, StopImmediately()), NoReply)
        await asyncio.sleep(60)
        assert line.last_error_at == erred_at


@virtual
async def test_a_fence_that_goes_first_is_no_error_of_the_line() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        await ask(line, MOVE)
        await ask(line, MOVE)
        assert far.frames == [MOVE_FRAME, "fence 02", MOVE_FRAME]
        assert line.last_error_at is None


# C8: between equal commands


@virtual
async def test_between_two_equal_commands_goes_a_fence() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        await ask(line, MOVE)
        await ask(line, MOVE)
        assert far.frames == [MOVE_FRAME, "fence 02", MOVE_FRAME]


@virtual
async def test_reads_and_commands_with_other_replies_need_no_fence() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        for command in (READ, READ, MOVE, MoveCounterclockwise(distance=1)):
            await ask(line, command)
        await ask(line, MoveCounterclockwise(distance=1), 3)
        assert not [frame for frame in far.frames if frame.startswith("fence")]


@virtual
async def test_the_fence_between_equal_commands_is_repeated_until_it_passes() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        await ask(line, MOVE)
        far.once("fence 02")
        assert isinstance(await ask(line, MOVE), Answered)
        assert far.frames == [MOVE_FRAME, "fence 02", "fence 02", MOVE_FRAME]


@virtual
async def test_a_body_that_dies_before_the_fence_between_gets_no_second_command() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        await ask(line, MOVE)
        far.silent = {2}
        assert isinstance(await ask(line, MOVE), BodyOffline)
        assert far.frames == [MOVE_FRAME, *["fence 02"] * FENCE_TRIES, "fence 03"][: len(far.frames)]


@virtual
async def test_a_probe_that_nobody_answered_is_no_fence_between() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        await ask(line, MOVE)
        far.silent = {0x44}
        assert isinstance(await line.probe(0x44, 0.1), NoReply)
        await ask(line, MOVE)
        assert far.frames == [MOVE_FRAME, "fence 44", "fence 02", MOVE_FRAME]


@virtual
async def test_one_doubled_reply_does_not_shift_the_reads_behind_it() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        for position in range(1, 13):
            said = f">&023PD{1000 * position:+010d}"
            copies = ((0.002, said),) if position == 1 else ()
            far.once(f"&023PDP[{position}]", (0.01, said), *copies)
        read = [
            pulses(await ask(line, GetPositionEntry(entry=PositionReference(position=position))))
            for position in range(1, 13)
        ]
        assert read == [1000 * position for position in range(1, 13)]
        assert line.counters["duplicates"] == 1


@virtual
async def test_a_doubled_acknowledgement_does_not_make_a_lost_setting_succeed() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        setting = SetPositionEntry(entry=PositionReference(position=1), pulses=7)
        frame = "&023PSP[1],7"
        assert isinstance(await ask(line, setting), Answered)
        assert isinstance(await ask(line, SetOverrunFactor(factor=2), 3), Answered)
        far.once(frame)
        far.say(">&023PS", after_s=0.005)
        assert isinstance(await ask(line, setting), NoReply)
        assert far.frames == [frame, "&030BS2", "fence 02", frame, "fence 02"]


@virtual
async def test_a_line_that_says_replies_twice_tells_so_and_brackets_what_it_acknowledges(
    caplog: pytest.LogCaptureFixture,
) -> None:
    far = FarEnd()
    changes: list[tuple[str, dict[str, object]]] = []
    async with running_line(far) as line:
        line.on_change = lambda what, facts: changes.append((what, facts))
        far.once(READ_FRAME, (0.01, f">{READ_FRAME}+000000009"), (0.02, f">{READ_FRAME}+000000009"))
        await ask(line, READ)
        await asyncio.sleep(0.1)
        assert line.strict
        assert changes == [("line.strict", {"strict": True})]
        assert "line line1 says replies twice" in caplog.text
        assert isinstance(await ask(line, MOVE), Answered)
        assert far.frames == [READ_FRAME, "fence 02", MOVE_FRAME, "fence 02"]
        await asyncio.sleep(STRICT_S)
        assert not line.strict
        assert changes[1:] == [("line.strict", {"strict": False})]


# stops

SLOW = 9600
BYTE_S = 10 / SLOW


@virtual
async def test_a_stop_waits_for_the_frame_boundary_and_not_for_the_reply() -> None:
    far = FarEnd(SLOW)
    async with running_line(far) as line:
        far.once(MOVE_FRAME, (0.4, ">&021+M"))
        move = ask(line, MOVE)
        await asyncio.sleep(3 * BYTE_S)
        stop = ask(line, StopImmediately())
        assert far.frames == [MOVE_FRAME]
        assert isinstance(await stop, Answered)
        moved_at, stopped_at = (at for at, _ in far.written)
        assert stopped_at - moved_at == pytest.approx((len(MOVE_FRAME) + 1) * BYTE_S)
        assert isinstance(await move, Answered)
        assert far.frames == [MOVE_FRAME, "&025IS"]


@virtual
async def test_stops_of_many_bodies_leave_one_frame_after_another_without_waiting() -> None:
    far = FarEnd(SLOW)
    async with running_line(far, range(8)) as line:
        stops = [ask(line, StopDecelerating(), body) for body in range(8)]
        await asyncio.gather(*stops)
        times = [at for at, _ in far.written]
        frame_s = 7 * BYTE_S
        for earlier, later in pairwise(times):
            assert later - earlier == pytest.approx(frame_s)


@virtual
async def test_a_stop_overtakes_everything_that_waits() -> None:
    far = FarEnd()
    async with running_line(far, range(4)) as line:
        ahead = [ask(line, command, body) for body in range(4) for command in (MOVE, READ)]
        stop = ask(line, StopImmediately(), 3)
        await asyncio.gather(*ahead, stop)
        assert far.frames[1] == "&035IS"


@virtual
async def test_a_stop_leaves_while_a_dead_body_is_waited_for_and_while_the_line_is_out_of_step() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.silent = {2}
        ask(line, MOVE)
        loop = asyncio.get_running_loop()
        stop_at = loop.time() + 0.1
        await asyncio.sleep(0.1)
        assert isinstance(await ask(line, StopImmediately(), 3), Answered)
        assert far.times_of("&035IS") == [pytest.approx(stop_at)]
        await until(lambda: line.state is LineState.OUT_OF_STEP)
        stop_at = loop.time() + 0.1
        await asyncio.sleep(0.1)
        assert isinstance(await ask(line, StopDecelerating(), 3), Answered)
        assert far.times_of("&035SS") == [pytest.approx(stop_at)]


@virtual
async def test_a_stop_without_a_reply_is_told_and_holds_up_nothing_further() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.once("&025IS")
        read = asyncio.ensure_future(ask(line, StopImmediately()))
        assert isinstance(await read, NoReply)
        assert line.state is LineState.READY
        assert pulses(await ask(line, READ)) == 0


@virtual
async def test_equal_stops_are_not_under_way_twice_and_those_that_wait_are_one() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        await asyncio.gather(*(ask(line, StopImmediately()) for _ in range(3)))
        first, second = far.times_of("&025IS")
        assert second >= first + LATENCY_S


@virtual
async def test_a_link_that_takes_no_frame_before_its_reply_gets_stops_after_replies() -> None:
    far = FarEnd()
    async with running_line(far, interject_stops=False) as line:
        far.once(MOVE_FRAME, (0.3, ">&021+M"))
        ask(line, MOVE)
        ask(line, READ, 3)
        stops = [ask(line, StopImmediately(), body) for body in (2, 3)]
        await asyncio.gather(*stops)
        assert far.frames[:3] == [MOVE_FRAME, "&025IS", "&035IS"]
        moved_at, first_at, second_at = (at for at, _ in far.written[:3])
        assert first_at == pytest.approx(moved_at + 0.3)
        assert second_at == pytest.approx(first_at + LATENCY_S)


@virtual
async def test_nothing_admitted_before_a_stop_is_written_after_it() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        first = ask(line, READ, 3)
        before, other, read = ask(line, MOVE), ask(line, MOVE, 3), ask(line, READ)
        line.gate.stop(2)
        after = ask(line, MoveTo(position=7))
        outcome = await before
        assert isinstance(outcome, Cancelled)
        assert outcome.moved == "no"
        assert all(isinstance(it, Answered) for it in await asyncio.gather(first, other, read, after))
        assert MOVE_FRAME not in far.frames
        assert "&021AM7" in far.frames


@virtual
async def test_a_guard_that_refuses_fences_does_not_hang_the_line() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        line.gate.add(
            lambda exchange, _: (
                NoReply("No fence, by this rule.") if exchange.reply.self_identifying else None
            )
        )
        far.once(MOVE_FRAME)
        assert isinstance(await ask(line, MOVE), NoReply)
        assert isinstance(await ask(line, StopImmediately()), Answered)


# time and room


@virtual
async def test_what_could_not_start_in_time_is_told_so_at_that_time_and_never_written() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        loop = asyncio.get_running_loop()
        far.once("&036PD")
        blocking = ask(line, READ, 3)
        expires_at = loop.time() + 0.2
        late = ask(line, MOVE, expires_at=expires_at)
        assert isinstance(await late, Expired)
        assert loop.time() == pytest.approx(expires_at)
        await blocking
        assert MOVE_FRAME not in far.frames


async def crowd_out(line: Line, for_s: float) -> None:
    """Stop all bodies, again and again."""
    ends_at = asyncio.get_running_loop().time() + for_s
    while asyncio.get_running_loop().time() < ends_at:
        stops = [line.submit(body, StopImmediately(), Lane.STOP) for body in line.bodies]
        await asyncio.wait(stops, return_when=asyncio.FIRST_COMPLETED)


@virtual
async def test_a_read_and_a_command_that_were_not_written_in_time_are_told_so_and_never_sent() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        loop = asyncio.get_running_loop()
        crowd = asyncio.create_task(crowd_out(line, 3 * WRITTEN_WITHIN_S))
        await asyncio.sleep(0.1)
        asked_at = loop.time()
        reads = [ask(line, GetPositionEntry(entry=PositionReference(position=at))) for at in range(40)]
        setting = ask(line, SetOverrunFactor(factor=1), 3)
        for outcome in await asyncio.gather(*reads, setting):
            assert isinstance(outcome, Expired)
            assert (outcome.moved, outcome.retryable) == ("no", True)
        assert loop.time() == pytest.approx(asked_at + WRITTEN_WITHIN_S, abs=0.02)
        assert {frame[3:] for frame in far.frames} == {"5IS"}
        await crowd


@virtual
async def test_reads_and_commands_have_a_turn_though_questions_of_motors_would_fill_the_line() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        ends_at = asyncio.get_running_loop().time() + 2.0

        async def wonder() -> None:
            while asyncio.get_running_loop().time() < ends_at:
                questions = [line.submit(body, READ, Lane.VERIFY) for body in line.bodies]
                await asyncio.wait(questions, return_when=asyncio.FIRST_COMPLETED)

        crowd = asyncio.create_task(wonder())
        await asyncio.sleep(0.1)
        asked_at = asyncio.get_running_loop().time()
        outcomes = await asyncio.gather(ask(line, GetControllerStatus()), ask(line, MOVE, 3))
        assert all(isinstance(outcome, Answered) for outcome in outcomes)
        assert TURN_S < asyncio.get_running_loop().time() - asked_at < TURN_S + 0.1
        await crowd


@virtual
async def test_a_shared_read_is_sent_while_it_is_not_too_late_for_one() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        crowd = asyncio.create_task(crowd_out(line, WRITTEN_WITHIN_S + 1.0))
        await asyncio.sleep(0.1)
        early = ask(line, GetControllerStatus())
        await asyncio.sleep(3.0)
        late = ask(line, GetControllerStatus())
        assert isinstance(await early, Expired)
        assert "&029CD" not in far.frames
        assert isinstance(await late, Answered)
        assert far.frames.count("&029CD") == 1
        await crowd


@virtual
async def test_what_a_motor_waits_for_is_never_too_late() -> None:
    far = FarEnd()
    async with running_line(far, interject_stops=False) as line:
        far.once("&036PD", (WRITTEN_WITHIN_S + 1.0, ">&036PD+000000001"))
        long = line.submit(3, READ, Lane.VERIFY)
        line._session.sent.first.reply.deadline = None  # type: ignore[union-attr]  # as long as it takes
        waiting = [ask(line, StopImmediately()), line.submit(2, READ, Lane.VERIFY)]
        assert all(isinstance(it, Answered) for it in await asyncio.gather(long, *waiting))


@virtual
async def test_one_timer_serves_all_who_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    far = FarEnd()
    async with running_line(far) as line:
        looked = 0
        expire = Scheduler.expire

        def counted(scheduler: Scheduler[RorzeExchange], now: float) -> float | None:
            nonlocal looked
            looked += 1
            return expire(scheduler, now)

        monkeypatch.setattr(Scheduler, "expire", counted)
        for _ in range(100):
            await asyncio.gather(ask(line, READ), ask(line, READ, 3))
        await asyncio.sleep(2 * WRITTEN_WITHIN_S)
        assert looked == 1


@virtual
async def test_too_many_waiting_requests_for_a_body_are_refused_but_stops_never() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        ask(line, READ, 3)
        waiting = [ask(line, MoveTo(position=at)) for at in range(QUEUE_LIMIT)]
        with pytest.raises(QueueFull):
            ask(line, MoveTo(position=-1))
        assert isinstance(await ask(line, StopImmediately()), Answered)
        line.cancel(lambda it: it.target == 2, Cancelled("Enough."))
        under_way, *rest = await asyncio.gather(*waiting)
        assert isinstance(under_way, Answered)
        assert {type(it) for it in rest} == {Cancelled}


@virtual
async def test_who_asked_hears_the_moment_of_the_write() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        moments: list[float] = []
        await ask(line, MOVE, on_written=moments.append)
        assert moments == far.times_of(MOVE_FRAME)


# the port


@virtual
async def test_when_the_port_is_lost_what_waited_was_not_sent_and_what_was_written_is_not_known() -> None:
    far = FarEnd()
    changes: list[str] = []
    async with running_line(far) as line:
        line.on_change = lambda what, _: changes.append(what)
        far.once(MOVE_FRAME)
        written, waiting, stopping = ask(line, MOVE), ask(line, MOVE, 3), ask(line, StopImmediately(), 3)
        far.unplug()
        assert isinstance(await written, NoReply)
        assert isinstance(await waiting, Cancelled)
        assert isinstance(await stopping, NoReply)
        assert line.state is LineState.DOWN
        with pytest.raises(PortNotOpen):
            ask(line, StopImmediately())
        assert isinstance(await line.probe(2, 0.1), PortNotOpen)
        far.plugged_in = True
        far.written.clear()
        await until(lambda: line.state is LineState.READY)
        assert far.frames == [*SET_UP_FRAMES]
        assert changes == ["line.down", "line.up"]
        assert isinstance(await ask(line, MOVE), Answered)


@virtual
async def test_a_late_reply_that_is_in_hand_is_told_even_when_the_port_is_lost() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.once(MOVE_FRAME, (0.6, ">&021+M"))
        far.once("fence 02")
        move = ask(line, MOVE)
        await until(lambda: line.counters["late_replies"])
        far.unplug()
        outcome = await move
        assert isinstance(outcome, Answered)
        assert outcome.late


@virtual
async def test_a_missing_port_is_tried_again_with_longer_and_longer_pauses() -> None:
    far = FarEnd()
    far.plugged_in = False
    line = Line("line1", far, [2])
    line.start()
    await asyncio.sleep(30)
    pauses = [later - earlier for earlier, later in pairwise(far.openings)]
    first, longest = REOPEN_S
    assert pauses[:4] == pytest.approx([first, 2 * first, 4 * first, 8 * first])
    assert pauses[-1] == pytest.approx(longest)
    assert "not plugged in" in line.down_reason
    far.plugged_in = True
    await until(lambda: line.state is LineState.READY)
    await line.close()


@virtual
async def test_a_port_that_drops_as_soon_as_it_is_open_is_tried_less_and_less_often() -> None:
    far = FarEnd()
    line = Line("line1", far, [2])
    line.start()

    async def opened(times: int) -> None:
        await until(lambda: len(far.openings) == times)
        await asyncio.sleep(0)

    for times in range(1, 6):
        await opened(times)
        far.unplug()
        far.plugged_in = True
    pauses = [later - earlier for earlier, later in pairwise(far.openings)]
    first, _ = REOPEN_S
    assert pauses == pytest.approx([first, 2 * first, 4 * first, 8 * first], abs=SILENCE_S + 0.01)
    await line.close()


@virtual
async def test_a_line_that_goes_and_comes_is_told_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO")
    far = FarEnd()
    async with running_line(far) as line:
        far.unplug()
        far.plugged_in = True
        await until(lambda: line.state is LineState.READY)
    told = [record.getMessage() for record in caplog.records]
    assert told[:3] == ["line line1 is up", "line line1 is down: the cable was pulled", "line line1 is up"]


@virtual
async def test_a_port_that_takes_no_bytes_is_opened_anew() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        stuck_at = asyncio.get_running_loop().time()
        far.stuck = True
        move, read = ask(line, MOVE), ask(line, READ)
        assert isinstance(await read, Cancelled)
        assert isinstance(await move, NoReply)
        noticed_after_s = REPLY_TIMEOUT_S + STUCK_S
        assert asyncio.get_running_loop().time() == pytest.approx(stuck_at + noticed_after_s, abs=0.01)
        far.stuck = False
        await until(lambda: line.state is LineState.READY)
        assert far.frames == ["&021+M500", *SET_UP_FRAMES]
        assert line.counters["openings"] == 1


@virtual
async def test_a_port_that_takes_its_time_is_waited_for() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.stuck = True
        ask(line, READ)
        stop = ask(line, StopImmediately())
        await asyncio.sleep(0.3)
        assert len(far.frames) == 1
        far.stuck = False
        assert isinstance(await stop, Answered)
        assert line.state is LineState.READY


@virtual
async def test_closing_a_line_settles_everything() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.once(MOVE_FRAME)
        written, waiting = ask(line, MOVE), ask(line, SetGroup(group="80", members=["02"]), LINK_MASTER)
    assert isinstance(await written, NoReply)
    assert isinstance(await waiting, Cancelled)


# the law, on any line that keeps its order

FAULTS = st.sampled_from(["none", "none", "command lost", "reply lost", "late", "garbled", "doubled"])
ASKED = st.tuples(st.sampled_from(["move", "read"]), st.integers(0, 2), FAULTS)


class FaultyEnd(FarEnd):
    """Does what it is told but for the faults in its plan, and remembers which reply has which cause."""

    def __init__(self, plan: list[str]) -> None:
        super().__init__()
        self.executed: list[str] = []
        self.plan = plan

    def _replies(self, frame: str) -> Any:
        if frame[3:6] not in ("1AM", "6PD"):
            return super()._replies(frame)
        fault = self.plan.pop(0) if self.plan else "none"
        if fault == "command lost":
            return ()
        self.executed.append(frame)
        reply = f">{frame[:6]}"
        if frame[3:6] == "6PD":
            reply += f"{len(self.executed):+010d}"
        return {
            "none": ((0.01, reply),),
            "reply lost": (),
            "late": ((0.8, reply),),
            "garbled": ((0.01, f"{reply[:-1]}?"),),
            "doubled": ((0.01, reply), (0.012, reply)),
        }[fault]


@settings(max_examples=60, deadline=None)
@given(st.lists(ASKED, min_size=1, max_size=12))
def test_no_reply_is_credited_to_another_command_and_no_move_is_written_twice(
    asked: list[tuple[str, int, str]],
) -> None:
    async def story() -> None:
        far = FaultyEnd([fault for _, _, fault in asked])
        async with running_line(far, range(3)) as line:
            far.executed.clear()
            await asyncio.gather(*(one(line, far, number, it) for number, it in enumerate(asked)))
            moves = [frame for frame in far.frames if "1AM" in frame]
            assert len(moves) == len(set(moves)) == sum(kind == "move" for kind, _, _ in asked)
            assert not line.offline

    async def one(line: Line, far: FaultyEnd, number: int, asked: tuple[str, int, str]) -> None:
        kind, body, _ = asked
        patience = asyncio.get_running_loop().time() + 600.0
        if kind == "move":
            outcome = await line.submit(body, MoveTo(position=number), Lane.COMMAND, expires_at=patience)
            if isinstance(outcome, Answered):
                assert f"&{body:02X}1AM{number}" in far.executed
        else:
            outcome = await line.submit(body, READ, Lane.READ, expires_at=patience)
            if isinstance(outcome, Answered):
                assert far.executed[pulses(outcome, body) - 1] == f"&{body:02X}6PD"

    run_virtual(story())
