"""The common part of all control interfaces: the faults of a line, and the truth page by page."""

from collections.abc import AsyncIterator
from random import Random
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

from simulator.control import MOST_FACTS, add_faults, add_truth
from simulator.faults import Direction, Fault, Faults, Switch
from simulator.truth import TruthLog

CAPACITY = 5


class Bench:
    """The faults and the truth of no machine in particular, and a client."""

    def __init__(self) -> None:
        self.faults = Faults(Random(0))
        self.truth = TruthLog(CAPACITY)
        app = FastAPI()
        add_faults(app, self.faults)
        add_truth(app, self.truth)
        transport = httpx.ASGITransport(app)
        self.http = httpx.AsyncClient(transport=transport, base_url="http://control")

    def log(self, facts: int) -> None:
        for number in range(facts):
            self.truth.log("tick", float(number), 0x3F, number=number)

    async def page(self, **query: int) -> tuple[int, list[int]]:
        """The cursor of the next page, and the numbers of the facts of this one."""
        answer = (await self.http.get("/truth", params=query)).json()
        return answer["next"], [fact["facts"]["number"] for fact in answer["facts"]]


@pytest.fixture
async def bench(anyio_backend: str) -> AsyncIterator[Bench]:
    bench = Bench()
    async with bench.http:
        yield bench


def switch(**changes: object) -> dict[str, Any]:
    return {"fault": "late", "direction": "replies", "next_frames": 2, "delay_s": 0.5, **changes}


@pytest.mark.anyio
async def test_a_fault_is_switched_on_changed_and_off_again(bench: Bench) -> None:
    on = await bench.http.put("/faults", json=switch(spread_s=0.25))
    assert bench.faults.switches == [
        Switch(Fault.LATE, Direction.REPLIES, next_frames=2, delay_s=0.5, spread_s=0.25)
    ]
    assert on.json() == (await bench.http.get("/faults")).json()
    assert on.json() == [switch(spread_s=0.25, probability=0.0, pass_frames=0, holds_up=False)]
    await bench.http.put("/faults", json=switch(next_frames=0, probability=1.0))
    assert bench.faults.switches == [Switch(Fault.LATE, Direction.REPLIES, probability=1.0, delay_s=0.5)]
    assert (await bench.http.put("/faults", json=switch(next_frames=0))).json() == []


@pytest.mark.anyio
async def test_clearing_ends_the_faults_of_both_directions(bench: Bench) -> None:
    for direction in ("requests", "replies"):
        await bench.http.put("/faults", json=switch(direction=direction))
    assert len(bench.faults.switches) == 2
    assert (await bench.http.delete("/faults")).status_code == 204
    assert bench.faults.switches == []


@pytest.mark.anyio
@pytest.mark.parametrize(
    "changes",
    [
        {"fault": "gremlin"},
        {"direction": "sideways"},
        {"probability": 1.1},
        {"probability": "1"},
        {"next_frames": -1},
        {"next_frames": 1.5},
        {"delay_s": -0.1},
        {"delay_s": 3601},
        {"spread_s": -1},
        {"colour": "red"},
    ],
    ids=repr,
)
async def test_what_is_no_fault_changes_nothing(bench: Bench, changes: dict[str, object]) -> None:
    answer = await bench.http.put("/faults", json=switch(**changes))
    assert answer.status_code == 422
    assert bench.faults.switches == []


@pytest.mark.anyio
async def test_a_fact_is_told_with_all_that_belongs_to_it(bench: Bench) -> None:
    bench.truth.request = 7
    bench.truth.log("axis_start", 1.5, 0x3, axis="Z")
    fact = {"kind": "axis_start", "time_s": 1.5, "body": "03", "request": 7, "facts": {"axis": "Z"}}
    assert (await bench.http.get("/truth")).json() == {"next": 1, "facts": [fact]}


@pytest.mark.anyio
async def test_the_truth_is_read_on_from_where_it_was_left(bench: Bench) -> None:
    bench.log(3)
    assert await bench.page(limit=2) == (2, [0, 1])
    assert await bench.page(after=2, limit=2) == (3, [2])
    assert await bench.page(after=3) == (3, [])
    bench.log(1)
    assert await bench.page(after=3) == (4, [0])


@pytest.mark.anyio
async def test_what_is_forgotten_is_skipped_and_the_count_goes_on(bench: Bench) -> None:
    bench.log(8)
    assert await bench.page(limit=2) == (5, [3, 4])
    assert await bench.page(after=5) == (8, [5, 6, 7])


@pytest.mark.anyio
async def test_who_asks_for_more_than_there_is_goes_on_at_the_end(bench: Bench) -> None:
    bench.log(2)
    assert await bench.page(after=100) == (2, [])


@pytest.mark.anyio
@pytest.mark.parametrize("query", ["after=-1", "limit=0", f"limit={MOST_FACTS + 1}", "after=x"])
async def test_no_other_pages_are_told(bench: Bench, query: str) -> None:
    assert (await bench.http.get(f"/truth?{query}")).status_code == 422
