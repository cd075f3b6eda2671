"""Long work with records: one task each, found while it goes on and after it is over."""

import asyncio
from dataclasses import dataclass
from math import inf
from operator import attrgetter

from gateway.core.works import Jobs
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
