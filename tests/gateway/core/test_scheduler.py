import asyncio
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.errors import Expired, NoReply, QueueFull
from gateway.core.exchange import QUEUE_LIMIT, STOPS, Lane, Series
from gateway.core.scheduler import TURN_S, Scheduler
from gateway.rorze.session import RorzeExchange
from protocols.rorze.moves import MoveTo
from protocols.rorze.notation import PositionReference
from protocols.rorze.position import GetPosition
from protocols.rorze.position_table import GetPositionEntry
from protocols.rorze.stops import StopDecelerating, StopImmediately
from tests.gateway.rorze.exchanges import exchange, waiting
from tests.gateway.rorze.far_end import virtual

ALL = tuple(Lane)


def move(body: int, position: int = 0) -> RorzeExchange:
    return exchange(MoveTo(position=position), body)


def taken(scheduler: Scheduler[RorzeExchange]) -> list[RorzeExchange]:
    out = []
    while (one := scheduler.next(ALL)) is not None:
        out.append(one)
    return out


def test_stops_go_first_then_proofs_then_commands_then_stops_of_the_dead_then_reads_then_the_rest() -> None:
    scheduler = Scheduler[RorzeExchange]()
    in_order = [
        exchange(StopImmediately(), 3),
        exchange(GetPosition(), 3, Lane.VERIFY),
        move(2),
        exchange(StopImmediately(), 4, Lane.STOP_REPEAT),
        exchange(GetPosition(), 1),
        exchange(GetPosition(), 1, Lane.BACKGROUND),
    ]
    for one in reversed(in_order):
        scheduler.submit(one)
    assert [scheduler.waiting(lane) for lane in ALL] == [1] * len(ALL)
    assert taken(scheduler) == in_order
    assert [scheduler.waiting(lane) for lane in ALL] == [0] * len(ALL)


@pytest.mark.parametrize(("lane", "is_stop"), [(lane, lane in STOPS) for lane in Lane])
def test_stops_of_both_lanes_are_known_to_wait(lane: Lane, is_stop: bool) -> None:
    scheduler = Scheduler[RorzeExchange]()
    assert not any(scheduler.stops)
    scheduler.submit(exchange(StopImmediately(), lane=lane))
    assert any(scheduler.stops) is is_stop


def test_only_the_lanes_that_may_send_are_asked() -> None:
    scheduler = Scheduler[RorzeExchange]()
    scheduler.submit(move(2))
    assert scheduler.next((Lane.STOP, Lane.READ)) is None


def test_a_busy_body_does_not_starve_the_others() -> None:
    scheduler = Scheduler[RorzeExchange]()
    for position in range(10):
        scheduler.submit(move(1, position))
    scheduler.submit(move(2))
    scheduler.submit(move(3))
    assert [one.target for one in taken(scheduler)][:4] == [1, 2, 3, 1]


@given(st.lists(st.one_of(st.integers(0, 5), st.just("take")), max_size=120))
def test_no_body_waits_more_than_one_turn_of_the_others(steps: list[int | str]) -> None:
    scheduler = Scheduler[RorzeExchange]()
    turns_waited: dict[int, Counter[int]] = {}
    queued: Counter[int] = Counter()
    for number, step in enumerate(steps):
        if isinstance(step, int):
            scheduler.submit(move(step, number))
            queued[step] += 1
            turns_waited.setdefault(step, Counter())
            continue
        one = scheduler.next(ALL)
        if one is None:
            assert not queued.total()
            continue
        queued[one.target] -= 1
        del turns_waited[one.target]
        for waited in turns_waited.values():
            waited[one.target] += 1
            assert waited[one.target] == 1
        if queued[one.target]:
            turns_waited[one.target] = Counter()


@given(st.lists(st.tuples(st.integers(0, 3), st.sampled_from(["move", "read"])), max_size=60))
def test_a_body_keeps_the_order_of_arrival_and_nothing_is_lost(arrivals: list[tuple[int, str]]) -> None:
    scheduler = Scheduler[RorzeExchange]()
    submitted = [
        move(body, number)
        if kind == "move"
        else exchange(GetPositionEntry(entry=PositionReference(position=number)), body)
        for number, (body, kind) in enumerate(arrivals)
    ]
    for one in submitted:
        scheduler.submit(one)
    out = taken(scheduler)
    assert len(out) == len(submitted)
    for body in range(4):
        for lane in ALL:
            mine = [one for one in submitted if one.target == body and one.lane is lane]
            assert [one for one in out if one.target == body and one.lane is lane] == mine


def test_a_body_that_may_not_go_is_passed_over_and_keeps_its_turn() -> None:
    scheduler = Scheduler[RorzeExchange]()
    first, second = exchange(StopImmediately(), 1), exchange(StopImmediately(), 2)
    scheduler.submit(first)
    scheduler.submit(second)
    assert scheduler.next(ALL, lambda it: it.target != 1) is second
    assert scheduler.next(ALL, lambda it: it.target != 1) is None
    assert scheduler.next(ALL) is first


@pytest.mark.parametrize("target", [1, 0x80])
def test_what_reaches_a_target_held_for_a_series_waits_for_its_end(target: int) -> None:
    scheduler = Scheduler[RorzeExchange]()
    scheduler.holders[1] = series = Series()
    scheduler.members = {0x80: [1, 2]}
    stop, stranger, member, beside = exchange(StopImmediately(), target), move(target), move(1), move(2)
    member.series = series
    for one in (stranger, member, beside, stop):
        scheduler.submit(one)
    assert taken(scheduler) == [stop, member, beside]
    scheduler.holders[1] = None
    assert taken(scheduler) == [stranger]


def test_a_frame_for_a_group_reaches_its_members() -> None:
    scheduler = Scheduler[RorzeExchange]()
    scheduler.members = {0x80: [1, 2]}
    assert [tuple(scheduler.reached(target)) for target in (0x80, 1)] == [(0x80, 1, 2), (1,)]


@virtual
async def test_equal_reads_share_one_exchange_and_all_who_asked_wait_for_it() -> None:
    loop = asyncio.get_running_loop()
    scheduler = Scheduler[RorzeExchange]()
    reads = [exchange(GetPosition()) for _ in range(3)]
    futures = [waiting(read, loop) for read in reads]
    assert {id(scheduler.submit(read)) for read in reads} == {id(reads[0])}
    assert taken(scheduler) == [reads[0]]
    assert list(reads[0].waiters) == futures
    assert scheduler.submit(another := exchange(GetPosition())) is another, "the first is under way"


def test_commands_and_reads_that_step_the_index_are_never_merged() -> None:
    scheduler = Scheduler[RorzeExchange]()
    step = GetPositionEntry(entry=PositionReference(position="next"))
    for command in (MoveTo(position=1), MoveTo(position=1), step, step):
        scheduler.submit(exchange(command))
    assert len(taken(scheduler)) == 4


def test_a_full_queue_refuses_but_for_stops_and_for_reads_that_join_one() -> None:
    scheduler = Scheduler[RorzeExchange]()
    for number in range(QUEUE_LIMIT):
        scheduler.submit(move(2, number))
        scheduler.submit(exchange(GetPositionEntry(entry=PositionReference(position=number))))
    with pytest.raises(QueueFull, match="nothing was sent"):
        scheduler.submit(move(2, -1))
    with pytest.raises(QueueFull):
        scheduler.submit(exchange(GetPosition()))
    scheduler.submit(exchange(GetPositionEntry(entry=PositionReference(position=0))))
    scheduler.submit(move(3))
    for body in range(QUEUE_LIMIT):
        scheduler.submit(exchange(StopImmediately(), body))
    assert scheduler.waiting(Lane.STOP) == QUEUE_LIMIT


def test_equal_stops_that_wait_are_one_unless_somebody_wants_to_know_when_his_is_written() -> None:
    scheduler = Scheduler[RorzeExchange]()
    first, again, noted = [exchange(StopImmediately()) for _ in range(3)]
    noted.on_written = lambda _: None
    assert scheduler.submit(first) is scheduler.submit(again)
    assert scheduler.submit(noted) is noted
    assert scheduler.submit(exchange(StopDecelerating())) is not first
    assert scheduler.waiting(Lane.STOP) == 3


def test_what_is_put_back_goes_first_of_its_body() -> None:
    scheduler = Scheduler[RorzeExchange]()
    first, second = move(2, 1), move(2, 2)
    scheduler.submit(first)
    scheduler.submit(second)
    scheduler.next(ALL)
    scheduler.put_back(first)
    assert taken(scheduler) == [first, second]


def test_the_unwanted_is_taken_out_of_every_lane() -> None:
    scheduler = Scheduler[RorzeExchange]()
    for body in (1, 2):
        for one in (move(body), exchange(GetPosition(), body), exchange(StopImmediately(), body)):
            scheduler.submit(one)
    assert [one.target for one in scheduler.remove(lambda it: it.target == 1)] == [1, 1, 1]
    assert [one.target for one in taken(scheduler)] == [2, 2, 2]


@virtual
async def test_what_is_too_late_is_taken_out_and_told() -> None:
    loop = asyncio.get_running_loop()
    scheduler = Scheduler[RorzeExchange]()
    late, timely, patient = (
        exchange(MoveTo(position=0), body, expires_at=at) for body, at in ((1, 5.0), (2, 5.1), (3, None))
    )
    futures = [waiting(one, loop) for one in (late, timely, patient)]
    for one in (late, timely, patient):
        scheduler.submit(one)
    assert scheduler.expire(4.9) == 5.0
    assert not futures[0].done()
    assert scheduler.expire(5.0) == 5.1
    assert isinstance(futures[0].result(), Expired)
    assert not futures[1].done()
    assert taken(scheduler) == [timely, patient]
    assert scheduler.expire(9.0) is None


@virtual
async def test_everybody_who_shares_a_read_has_a_deadline_of_his_own() -> None:
    loop = asyncio.get_running_loop()
    scheduler = Scheduler[RorzeExchange]()
    reads = [exchange(GetPosition(), expires_at=at) for at in (6.0, 5.0, 7.0)]
    middle, early, late = (waiting(read, loop) for read in reads)
    for read in reads:
        scheduler.submit(read)
    assert scheduler.expire(5.5) == 6.0
    assert isinstance(early.result(), Expired)
    assert scheduler.expire(6.0) == 7.0
    assert isinstance(middle.result(), Expired)
    assert not late.done()
    assert taken(scheduler) == [reads[0]]
    assert reads[0].expires_at == 7.0


@virtual
async def test_a_read_shared_with_somebody_who_has_all_the_time_is_never_too_late_for_him() -> None:
    loop = asyncio.get_running_loop()
    for deadlines in ((5.0, None), (None, 5.0)):
        scheduler = Scheduler[RorzeExchange]()
        reads = [exchange(GetPosition(), expires_at=at) for at in deadlines]
        futures = [waiting(read, loop) for read in reads]
        for read in reads:
            scheduler.submit(read)
        assert scheduler.expire(5.0) is None
        assert [future.done() for future in futures] == [at is not None for at in deadlines]
        assert taken(scheduler) == [reads[0]]


@virtual
async def test_what_was_written_once_and_is_too_late_for_the_repetition_has_had_no_reply() -> None:
    scheduler = Scheduler[RorzeExchange]()
    read = exchange(GetPosition(), expires_at=5.0)
    future = waiting(read, asyncio.get_running_loop())
    read.reply.doubt = NoReply("6PD was sent to body 02, and no reply came.")
    scheduler.put_back(read)
    scheduler.expire(5.0)
    assert future.result() is read.reply.doubt


@virtual
async def test_the_background_has_a_turn_after_half_a_second_of_clients_reads() -> None:
    loop, scheduler = asyncio.get_running_loop(), Scheduler[RorzeExchange]()
    background = scheduler.submit(exchange(GetPosition(), 9, Lane.BACKGROUND))
    kept = [waiting(background, loop)]
    for step in range(40):
        client = scheduler.submit(exchange(GetPosition(), step))
        kept.append(waiting(client, loop))
        if scheduler.next_wanted(now := step * 0.03) is background:
            break
    assert now == pytest.approx(TURN_S, abs=0.03)
