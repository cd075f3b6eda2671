"""A full line: what the gateway takes of it for itself, and how soon people and motors are served."""

import asyncio
import re
from collections import Counter
from collections.abc import AsyncIterator, Iterable
from contextlib import asynccontextmanager, suppress
from statistics import quantiles

import pytest

from gateway.core.errors import GatewayError
from gateway.core.move_record import Move
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.notation import PositionReference
from protocols.rorze.position import GetPosition
from protocols.rorze.position_table import GetPositionEntry
from simulator.rorze.rc400 import LinkSettings
from tests.gateway.rorze.full_line import FULL, SWEEP_GROUPS, busy_s, full_line, teach
from tests.gateway.rorze.test_body_power import now
from tests.plants import Rig, TerminalServer, Wire, in_virtual_time, rig, start

IDLE_SHARE = 0.1
GET_WITHIN_S = 0.25
END_TOLD_WITHIN_S = 1.5
END_TOLD_ON_A_BAD_LINE_S = 4.0
"""Seconds on a line on which everything is read twice."""
STOPPED_WITHIN_S = 5.0
STOPPED_WITHOUT_GROUPS_WITHIN_S = 6.0
STOPPED_AT_START_WITHIN_S = {1.0: 8.0, 4.0: 6.0, 10.0: 5.0}
"""Seconds within which stops are confirmed, by seconds after the line is ready.

At first each body is asked for a program and its place, and told to end a program; to learn that the gateway
takes half of the line.
"""
OUTAGE_S = 8.0
CONFIRMED_AFTER_AN_OUTAGE_S = 20.0
"""Seconds for stops after an outage: frames written meanwhile go first, and fill half of the line."""
SILENCE_S = 9.0
"""Long enough to take the whole line for dead."""
ALL_BACK_WITHIN_S = {SWEEP_GROUPS: 4.5, "": 7.5}
"""Alone a probe of each of 118 takes 42 ms of the line, and clients, who go first, take a quarter of it."""
DEAD = range(0x20, 0x2A)
MOVERS = [f"{4 * number:02X}" for number in range(30)]


@pytest.mark.parametrize("options", [SWEEP_GROUPS, ""])
@in_virtual_time
async def test_an_idle_gateway_takes_a_tenth_of_the_line(options: str) -> None:
    async with full_line(options) as it:
        await asyncio.sleep(30.0)
        for _ in range(12):
            began_at = now()
            await asyncio.sleep(10.0)
            assert busy_s(it, began_at) <= IDLE_SHARE * 10.0
            load = it.plant.line("line1").load_percent()
            assert load.keys() == {"health"}
            assert load["health"] == pytest.approx(10 * busy_s(it, began_at), abs=2.0)


@pytest.mark.parametrize("options", [SWEEP_GROUPS, ""])
@in_virtual_time
async def test_a_client_is_served_at_once_while_the_gateway_gets_to_know_120_bodies(options: str) -> None:
    async with rig(bodies=FULL, groups={}, baud=9600, options=options, beginning=True) as it:
        await it.body("77").ask(GetPosition())  # the line is ready
        for body in ("00", "01", "3F"):
            asked_at = now()
            await it.body(body).ask(GetPosition())
            assert now() - asked_at < GET_WITHIN_S


@pytest.mark.parametrize("options", [SWEEP_GROUPS, ""])
@in_virtual_time
async def test_nobody_is_called_unreadable_where_clients_take_the_whole_line_from_the_start(
    options: str,
) -> None:
    async with rig(bodies=FULL, groups={}, baud=9600, options=options, beginning=True) as it:
        readers = [asyncio.create_task(read_on(it, "3F", entry)) for entry in (0, 1)]
        await asyncio.sleep(30.0)
        assert it.types("body.unreadable") == []
        for reader in readers:
            reader.cancel()
        await asyncio.sleep(30.0)
        assert all(body.told.position is not None for body in it.plant.bodies())


@in_virtual_time
async def test_bodies_that_rest_are_read_at_once_and_ends_are_told_while_30_motors_move() -> None:
    async with full_line() as it:
        it.wire.deaf_to = re.compile(rb">&7D[^\r]*\r")
        await teach(it, MOVERS)
        moves = [
            await start(it, MoveClockwise(distance=50_000 + 4_000 * n), mover)
            for n, mover in enumerate(MOVERS)
        ]
        over = asyncio.gather(*(told_at(it, move) for move in moves))
        took_s: list[float] = []
        while not over.done():
            asked_at = now()
            await it.body(f"{(4 * len(took_s) + 1) % 120:02X}").ask(GetPosition())
            took_s.append(now() - asked_at)
            await asyncio.sleep(0.1)
        assert quantiles(took_s, n=100)[98] < GET_WITHIN_S
        late_s = [at - ended_at(it, move) for at, move in zip(await over, moves, strict=True)]
        assert all(move.status == "succeeded" for move in moves)
        assert 0 <= min(late_s) <= max(late_s) <= END_TOLD_WITHIN_S


@in_virtual_time
async def test_ends_are_told_soon_while_120_bodies_are_looked_at_anew() -> None:
    async with full_line() as it:
        it.wire.deaf_to = re.compile(rb">&7D[^\r]*\r")
        await teach(it, MOVERS)
        moves = [
            await start(it, MoveClockwise(distance=30_000 + 2_000 * n), mover)
            for n, mover in enumerate(MOVERS)
        ]
        it.wire.unplug()
        it.wire.plugged_in = True
        told = await asyncio.gather(*(told_at(it, move) for move in moves))
        late_s = [at - ended_at(it, move) for at, move in zip(told, moves, strict=True)]
        assert all(move.status == "succeeded" for move in moves)
        assert max(late_s) <= END_TOLD_ON_A_BAD_LINE_S


@in_virtual_time
async def test_the_end_of_a_stopped_move_is_told_while_a_client_reads_all_the_time() -> None:
    """As a restore does, two of whose questions wait at any time."""
    async with full_line("") as it:
        await teach(it, ["00"])
        move = await start(it, MoveClockwise(distance=500_000), "00")
        readers = [asyncio.create_task(read_on(it, "3F", entry)) for entry in (0, 1)]
        await asyncio.sleep(1.0)
        await it.plant.stops.stop([it.body("00")], "immediate")
        late_s = await told_at(it, move) - ended_at(it, move)
        assert (move.status, move.end_cause) == ("stopped", "stop_command")
        assert late_s <= END_TOLD_WITHIN_S
        for reader in readers:
            reader.cancel()


async def look_again_and_again(rig: Rig, body: str) -> None:
    """As a client does that shows a position."""
    while True:
        with suppress(GatewayError):
            await rig.body(body).ask(GetPosition())
        await asyncio.sleep(0.2)


@asynccontextmanager
async def line_that_was_silent(
    options: str = SWEEP_GROUPS, switched_off: Iterable[int] = ()
) -> AsyncIterator[Rig]:
    """A line with two bodies in use that was silent for a while; some bodies have lost their power."""
    async with full_line(options) as it:
        clients = [asyncio.create_task(look_again_and_again(it, body)) for body in ("00", "3F")]
        await asyncio.sleep(1.0)
        it.wire.deaf_to = re.compile(rb"[^\r]*\r")
        await asyncio.sleep(SILENCE_S)
        assert len(it.plant.line("line1").offline) == len(FULL)
        for number in switched_off:
            it.machine.switch_body(number, on=False, now=now())
        it.wire.deaf_to = None
        yield it
        for client in clients:
            client.cancel()


@pytest.mark.parametrize("options", [SWEEP_GROUPS, ""])
@in_virtual_time
async def test_when_one_body_of_a_silent_line_answers_again_all_others_are_asked_at_once(
    options: str,
) -> None:
    async with line_that_was_silent(options) as it:
        await asyncio.sleep(ALL_BACK_WITHIN_S[options])
        assert not it.plant.line("line1").offline


@in_virtual_time
async def test_the_dead_among_them_are_asked_rarely_and_hold_nobody_up() -> None:
    async with line_that_was_silent("", DEAD) as it:
        since = len(it.wire.sent)
        await asyncio.sleep(10.0)
        probes = [frame for frame in it.wire.frames(since) if frame[3:6] == "3ND"]
        assert sum(int(frame[1:3], 16) in DEAD for frame in probes) <= 6
        since, took_s = len(it.wire.sent), []
        for _ in range(50):
            asked_at = now()
            await it.body("00").ask(GetPosition())
            took_s.append(now() - asked_at)
            await asyncio.sleep(0.1)
        assert quantiles(took_s, n=10)[8] < GET_WITHIN_S
        await asyncio.sleep(60.0)
        assert it.plant.line("line1").offline == set(DEAD)


@in_virtual_time
async def test_groups_find_all_that_live_beside_the_dead() -> None:
    async with line_that_was_silent(SWEEP_GROUPS, DEAD) as it:
        await asyncio.sleep(ALL_BACK_WITHIN_S[SWEEP_GROUPS] + 2.0)
        assert it.plant.line("line1").offline == set(DEAD)


@in_virtual_time
async def test_who_does_not_come_back_with_the_line_is_told_as_silent_itself() -> None:
    async with line_that_was_silent(SWEEP_GROUPS, [0x2A]) as it:
        before = it.plant.events.last
        await asyncio.sleep(ALL_BACK_WITHIN_S[SWEEP_GROUPS] + 2.0)
        told = [event for event in it.events("body.offline") if event.number > before]
        assert [(event.subject, event.data["asked"]) for event in told] == [("/bodies/line1.2A", True)]


@in_virtual_time
async def test_a_port_that_goes_while_all_are_asked_tells_of_nobody() -> None:
    async with line_that_was_silent("") as it:
        await asyncio.sleep(2.0)
        before = it.plant.events.last
        it.wire.unplug()
        await asyncio.sleep(5.0)
        assert [event.type for event in it.events("body.offline") if event.number > before] == []
        it.wire.plugged_in = True
        await asyncio.sleep(20.0)
        assert not it.plant.line("line1").offline


@in_virtual_time
async def test_a_stop_goes_out_at_once_while_all_are_asked_whether_they_are_there() -> None:
    async with line_that_was_silent("") as it:
        await asyncio.sleep(2.0)
        assert 20 < len(it.plant.line("line1").offline) < 110
        asked_at = now()
        [report] = await it.plant.stops.stop([it.body("77")], "immediate")
        assert report.state == "confirmed"
        first = next(sent for sent in it.wire.sent if sent.frame == "&775IS")
        assert first.at - asked_at < 0.05


async def read_on(rig: Rig, body: str, entry: int) -> None:
    while True:
        await rig.body(body).ask(GetPositionEntry(entry=PositionReference(position=entry)))


async def told_at(rig: Rig, move: Move) -> float:
    await rig.plant.moves.wait(move.id, 120.0)
    return now()


def ended_at(rig: Rig, move: Move) -> float:
    return rig.truth.of("pulses_stop", int(move.body_id[-2:], 16))[-1].at


@in_virtual_time
async def test_a_stop_of_all_is_confirmed_within_5_s_and_nobody_is_alarmed() -> None:
    async with full_line() as it:
        await asyncio.sleep(60.0)  # where no program runs is known
        await teach(it, MOVERS)
        for mover in MOVERS:
            await start(it, MoveClockwise(distance=500_000), mover)
        asked_at, sent = now(), len(it.wire.sent)
        reports = await it.plant.stops.stop(it.plant.bodies(), "immediate")
        assert now() - asked_at <= STOPPED_WITHIN_S
        assert {report.state for report in reports} == {"confirmed"}
        assert all(report.position is not None for report in reports)
        assert it.types("body.stop.unconfirmed") == []
        frames = it.wire.frames(sent)
        assert frames[:120] == [f"&{number:02X}5IS" for number in FULL]
        assert not any(frame[3:6] in ("URD", "UES") for frame in frames)


@pytest.mark.parametrize("after_s", STOPPED_AT_START_WITHIN_S)
def test_a_stop_of_all_soon_after_the_start_is_confirmed_by_groups_too(after_s: float) -> None:
    @in_virtual_time
    async def story() -> None:
        async with rig(bodies=FULL, groups={}, baud=9600, options=SWEEP_GROUPS, beginning=True) as it:
            await asyncio.sleep(after_s)
            asked_at = now()
            reports = await it.plant.stops.stop(it.plant.bodies(), "immediate")
            assert now() - asked_at <= STOPPED_AT_START_WITHIN_S[after_s]
            assert {report.state for report in reports} == {"confirmed"}

    story()


@in_virtual_time
async def test_where_no_program_runs_is_known_soon_after_the_start_in_one_frame_for_each_group() -> None:
    async with rig(bodies=FULL, groups={}, baud=9600, options=SWEEP_GROUPS, beginning=True) as it:
        await asyncio.sleep(4.0)
        assert all(body.runs_no_program() for body in it.plant.bodies())
        assert sum(frame.endswith("URD") for frame in it.wire.frames()) == 8


@pytest.mark.parametrize("after_s", [0.2, 3.0])
def test_a_stop_in_the_midst_of_setting_up_goes_before_that_and_a_slow_link_alarms_nobody(
    after_s: float,
) -> None:
    @in_virtual_time
    async def story() -> None:
        slow = LinkSettings(reply_delay_s=0.04)
        async with rig(
            bodies=FULL, groups={}, baud=9600, settings=slow, options=SWEEP_GROUPS, beginning=True
        ) as it:
            for mover in MOVERS:
                it.machine.axes[int(mover, 16)].execute("1+M900000", now())
            await asyncio.sleep(after_s)
            sent = len(it.wire.sent)
            reports = await it.plant.stops.stop(it.plant.bodies(), "immediate")
            assert {report.state for report in reports} == {"confirmed"}
            assert it.wire.frames(sent)[:120] == [f"&{number:02X}5IS" for number in FULL]
            assert it.types("body.stop.unconfirmed") == []

    story()


@pytest.mark.parametrize("bodies", [range(30), FULL])
@pytest.mark.parametrize("wire", [Wire, TerminalServer])
@in_virtual_time
async def test_without_groups_a_stop_of_all_takes_longer_and_alarms_nobody(
    bodies: range, wire: type[Wire]
) -> None:
    async with full_line("", bodies=bodies, wire=wire) as it:
        reports = await it.plant.stops.stop(it.plant.bodies(), "immediate")
        assert {report.state for report in reports} == {"confirmed"}
        assert it.types("body.stop.unconfirmed") == []


@in_virtual_time
async def test_one_that_was_seen_at_rest_and_told_nothing_since_is_asked_once_whether_it_stands() -> None:
    async with full_line("") as it:
        await asyncio.sleep(60.0)
        await teach(it, MOVERS)
        for mover in MOVERS:
            await start(it, MoveClockwise(distance=500_000), mover)
        await asyncio.sleep(1.0)
        asked_at, sent = now(), len(it.wire.sent)
        reports = await it.plant.stops.stop(it.plant.bodies(), "immediate")
        assert now() - asked_at <= STOPPED_WITHOUT_GROUPS_WITHIN_S
        assert {report.state for report in reports} == {"confirmed"}
        looks = Counter(frame[1:3] for frame in it.wire.frames(sent) if frame[3:6] == "9CD")
        assert all(looks[mover] >= 2 for mover in MOVERS)
        assert sum(looks.values()) < 1.5 * len(FULL)


@in_virtual_time
async def test_a_stop_of_all_through_a_terminal_server_is_confirmed_within_5_s() -> None:
    async with full_line(wire=TerminalServer) as it:
        asked_at = now()
        reports = await it.plant.stops.stop(it.plant.bodies(), "immediate")
        assert {report.state for report in reports} == {"confirmed"}
        assert now() - asked_at < STOPPED_WITHIN_S
        assert it.types("body.stop.unconfirmed") == []


@pytest.mark.parametrize("options", [SWEEP_GROUPS, ""])
@in_virtual_time
async def test_stops_that_the_network_held_back_leave_room_for_their_proofs(options: str) -> None:
    async with full_line(options, wire=TerminalServer) as it:
        assert isinstance(it.wire, TerminalServer)
        it.wire.reached_again_at = now() + OUTAGE_S
        reports = await it.plant.stops.stop(it.plant.bodies(), "immediate")
        assert {report.state for report in reports} == {"sent"}
        await it.plant.stops.confirmed()
        assert now() - it.wire.reached_again_at < CONFIRMED_AFTER_AN_OUTAGE_S


@in_virtual_time
async def test_a_silent_body_is_told_after_two_seconds_however_many_are_stopped() -> None:
    async with full_line() as it:
        it.machine.switch_body(7, on=False, now=now())
        asked_at = now()
        stopping = it.plant.stops.stop(it.plant.bodies(), "immediate")
        await anext(it.plant.events.subscribe(types=["body.stop.unconfirmed"]))
        assert now() - asked_at < 2.5
        assert [it.body_id for it in await stopping if it.state != "confirmed"] == ["line1.07"]


@in_virtual_time
async def test_a_line_that_was_silent_is_set_up_once_when_120_bodies_answer_again() -> None:
    async with full_line() as it:
        line = it.plant.line("line1")
        news = it.plant.events.subscribe(types=["line.down", "line.up"])
        it.wire.deaf_to = re.compile(rb"[^\r]*\r")
        await it.plant.stops.stop(it.plant.bodies(), "immediate")
        assert (await anext(news)).type == "line.down"
        before = line.counters["set_ups_again"]
        it.wire.deaf_to = None
        assert (await anext(news)).type == "line.up"
        await asyncio.sleep(30.0)
        assert not line.offline
        assert line.counters["set_ups_again"] <= before + 1
