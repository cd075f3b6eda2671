"""The memory of moves, and the waiters for their ends."""

import asyncio
import gc
from datetime import UTC, datetime, timedelta

import pytest

from gateway.core.errors import BodyBusy, NotFound
from gateway.core.move_log import HISTORY, MoveLog
from gateway.core.move_record import MoveError, MoveRecord, MoveStatus
from gateway.core.origin import new_id
from tests.gateway.rorze.far_end import virtual

NOW = datetime(2026, 1, 1, tzinfo=UTC)
RUNNING = (MoveStatus.QUEUED, MoveStatus.SENT, MoveStatus.MOVING)


def a_move(move_id: str, status: MoveStatus = MoveStatus.MOVING, body: str = "line1.3F") -> MoveRecord:
    return MoveRecord(
        id=move_id, body_id=body, status=status, command="1+M", frame="&3F1+M5\\r", created_at=NOW
    )


def log_of(*moves: MoveRecord) -> MoveLog[MoveRecord]:
    log = MoveLog[MoveRecord]()
    for move in moves:
        log.add(move)
    return log


def test_a_move_is_found_by_its_id_and_those_of_a_body_newest_first() -> None:
    log = log_of(a_move("1"), a_move("2", body="line1.00"), a_move("3"))
    assert log.get("2").body_id == "line1.00"
    assert [move.id for move in log.of("line1.3F")] == ["3", "1"]
    assert log.of("line2.3F") == []


def test_the_oldest_that_are_over_are_forgotten_for_new_ones() -> None:
    log = log_of(*(a_move(str(number), MoveStatus.SUCCEEDED) for number in range(HISTORY)))
    assert log.get("0").id == "0"
    log.add(a_move("new"))
    with pytest.raises(NotFound, match=r"no move 0; .* until 1000 newer ones exist\.$"):
        log.get("0")
    assert [log.get(kept).id for kept in ("1", "new")] == ["1", "new"]


@pytest.mark.parametrize("status", MoveStatus)
def test_what_still_runs_is_never_forgotten(status: MoveStatus) -> None:
    log = log_of(a_move("old", status))
    for number in range(HISTORY + 5):
        log.add(a_move(str(number), MoveStatus.SUCCEEDED))
    kept = "old" in [move.id for move in log.of("line1.3F")]
    assert kept == (status in RUNNING)


def test_many_that_run_at_once_are_all_kept_and_go_when_they_are_over() -> None:
    moves = [a_move(str(number)) for number in range(HISTORY + 10)]
    log = log_of(*moves)
    assert len(log.of("line1.3F")) == HISTORY + 10
    for move in moves:
        move.status = MoveStatus.FAILED
        log.end(move)
    log.add(a_move("new"))
    assert len(log.of("line1.3F")) == HISTORY


@virtual
async def test_all_who_wait_hear_of_the_end_at_once() -> None:
    move = a_move("1")
    log = log_of(move)
    waiters = [asyncio.create_task(log.wait("1", 10.0)) for _ in range(3)]
    await asyncio.sleep(1.0)
    assert not any(waiter.done() for waiter in waiters)
    move.status = MoveStatus.STOPPED
    log.end(move)
    assert [waited.status for waited in await asyncio.gather(*waiters)] == [MoveStatus.STOPPED] * 3
    assert asyncio.get_running_loop().time() == pytest.approx(1.0)


@virtual
async def test_when_the_time_is_up_the_move_is_given_as_it_is() -> None:
    log = log_of(a_move("1"))
    assert (await log.wait("1", 2.5)).status is MoveStatus.MOVING
    assert asyncio.get_running_loop().time() == pytest.approx(2.5)


@pytest.mark.parametrize(("status", "timeout_s"), [(MoveStatus.SUCCEEDED, 10.0), (MoveStatus.MOVING, 0.0)])
def test_nobody_waits_for_what_is_over_or_without_patience(status: MoveStatus, timeout_s: float) -> None:
    @virtual
    async def story() -> None:
        assert (await log_of(a_move("1", status)).wait("1", timeout_s)).status is status
        assert asyncio.get_running_loop().time() == 0.0

    story()


@virtual
async def test_a_move_forgotten_while_somebody_waits_is_given_to_him_nevertheless() -> None:
    move = a_move("old")
    log = log_of(move)
    waiter = asyncio.create_task(log.wait("old", 10.0))
    await asyncio.sleep(1.0)
    move.status = MoveStatus.SUCCEEDED
    log.end(move)
    for number in range(HISTORY):
        log.add(a_move(str(number)))
    assert (await waiter) is move
    with pytest.raises(NotFound):
        await log.wait("old", 10.0)


def test_ids_sort_by_time_and_never_repeat() -> None:
    later = [new_id(NOW + timedelta(milliseconds=number)) for number in range(100)]
    assert later == sorted(later)
    assert len({new_id(NOW) for _ in range(100)}) == 100


@virtual
async def test_at_the_end_nobody_waits_any_longer_and_the_move_is_given_as_it_is() -> None:
    move = a_move("1")
    log = log_of(move)
    waiting = asyncio.create_task(log.wait("1", 60.0))
    await asyncio.sleep(1.0)
    log.let_go()
    assert await waiting is move
    assert await log.wait("1", 60.0) is move
    assert asyncio.get_running_loop().time() == 1.0


def test_a_move_that_is_over_keeps_nothing_to_wait_with() -> None:
    log = log_of(a_move("over"), a_move("runs"))
    log.get("over").status = MoveStatus.SUCCEEDED
    log.end(log.get("over"))
    events = [it for held in gc.get_referents(log.__dict__) for it in gc.get_referents(held)]
    assert sum(isinstance(it, asyncio.Event) for it in events) == 1


def test_a_move_that_is_over_is_nothing_for_the_garbage_collector_to_look_through() -> None:
    move = a_move("over")
    log = log_of(move)
    move.status, move.evidence = MoveStatus.FAILED, ["The status tells so."]
    move.error = MoveError.of(BodyBusy("It moves.", "Wait."))
    log.end(move)
    gc.collect()
    [kept] = [it for it in gc.get_referents(log._moves) if not isinstance(it, str)]
    assert not gc.is_tracked(kept)
    assert log.get("over") == move
    assert log.of("line1.3F", 1) == [move]
