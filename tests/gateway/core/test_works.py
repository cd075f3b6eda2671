"""Long work with records: one task each, found while it goes on and after it is over."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from math import inf
from operator import attrgetter

import pytest

from gateway.core import records
from gateway.core.works import CutOff, DurableJobs, Jobs
from tests.plants import in_virtual_time


@dataclass(frozen=True)
class Record:
    id: str
    of: str = "a"


def begin(works: Jobs[Record], record_id: str, takes_s: float, of: str = "a") -> Record:
    record = Record(record_id, of)
    works.begin(record, asyncio.sleep(takes_s), "work")
    return record


@in_virtual_time
async def test_a_record_is_found_while_its_work_goes_on_and_afterwards() -> None:
    works: Jobs[Record] = Jobs(10, "work", attrgetter("of"))
    record = begin(works, "1", 5.0)
    assert works.goes_on(record)
    assert list(works.under_way()) == [record]
    await works.wait(record, 1.0)
    assert works.goes_on(record)
    await works.wait(record, inf)
    assert not works.goes_on(record)
    assert works.find("a", "1") == record
    assert works.find("a", "2") is None


@in_virtual_time
async def test_current_is_the_newest_of_those_that_are_meant() -> None:
    works: Jobs[Record] = Jobs(10, "work", attrgetter("of"))
    first, _, _ = begin(works, "1", 1.0, "a"), begin(works, "2", 1.0, "b"), begin(works, "3", 1.0, "b")
    assert works.find("a") == first
    assert works.find("a", "2") is None
    await works.close()


@in_virtual_time
async def test_the_oldest_records_are_forgotten_but_never_those_under_way() -> None:
    works: Jobs[Record] = Jobs(2, "work", attrgetter("of"))
    long = begin(works, "1", 100.0)
    for number in range(2, 6):
        await works.wait(begin(works, str(number), 1.0), inf)
    assert works.find("a", "1") == long
    assert [works.find("a", str(number)) is not None for number in range(2, 6)] == [False, False, False, True]
    await works.close()


@in_virtual_time
async def test_work_is_broken_off_one_by_one_or_all_at_once() -> None:
    works: Jobs[Record] = Jobs(10, "work", attrgetter("of"))
    first, second = begin(works, "1", 100.0), begin(works, "2", 100.0)
    works.break_off(first)
    await works.wait(first, inf)
    assert list(works.under_way()) == [second]
    await works.close()
    assert not list(works.under_way())
    works.break_off(second)


BEGUN = datetime(2026, 1, 1, tzinfo=UTC)


class Chore(records.Record):
    id: str
    of: str = "a"
    said: str = ""
    started_at: datetime = BEGUN
    ended_at: datetime | None = None


class Chores(DurableJobs[Chore]):
    record_type = Chore

    def __init__(self, publish: Callable[[str, Chore], None], history: int = 10) -> None:
        super().__init__(history, "chore", attrgetter("of"), publish)

    def note_cut_off(self, record: Chore, why: CutOff, /) -> None:
        record.said, record.ended_at = f"cut off by {why.kind}", BEGUN
        self.tell("failed", record)


def chores(history: int = 10) -> tuple[Chores, list[str]]:
    told: list[str] = []
    of = Chores(lambda what, chore: told.append(f"{what} {chore.id}"), history)
    of.on_change = lambda chore: told.append(f"kept {chore.id} {chore.said}".rstrip())
    return of, told


def test_what_is_told_is_kept_first() -> None:
    of, told = chores()
    of.tell("started", Chore(id="1"))
    assert told == ["kept 1", "started 1"]


def test_what_was_not_over_was_cut_off_and_the_rest_stays_as_it_was() -> None:
    of, told = chores()
    over = Chore(id="1", said="done", ended_at=BEGUN)
    of.resume([over.model_dump_json(), Chore(id="2").model_dump_json()])
    assert of.find("a", "1") == over
    assert of.find("a") == Chore(id="2", said="cut off by gateway-ended", ended_at=BEGUN)
    assert told == ["kept 2 cut off by gateway-ended", "failed 2"]


def test_no_more_is_remembered_than_one_life_keeps() -> None:
    of, _ = chores(history=2)
    of.resume(Chore(id=str(number), ended_at=BEGUN).model_dump_json() for number in range(5))
    assert [number for number in range(5) if of.find("a", str(number))] == [3, 4]


def test_a_record_that_cannot_be_read_is_forgotten_with_a_word(caplog: pytest.LogCaptureFixture) -> None:
    of, told = chores()
    of.resume(['{"id": 1}', Chore(id="2", ended_at=BEGUN).model_dump_json()])
    assert of.find("a", "2") is not None
    assert told == []
    assert "a chore of an earlier life cannot be read, and is forgotten: '{\"id\": 1}'" in caplog.text
