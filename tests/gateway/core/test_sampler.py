"""A sampler asks for what is due first, within its share of the line, and for nothing without a watcher."""

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any, ClassVar, cast

from gateway.core.errors import PortNotOpen
from gateway.core.events import EventHub
from gateway.core.load import Load
from gateway.core.origin import LIVE, current
from gateway.core.sampler import REST_S, LiveSource, Sampler
from tests.plants import in_virtual_time
from tests.watching import watching

ASKING_S = 0.01


@dataclass
class Line:
    """A line that each question takes up for this time."""

    load: Load = field(default_factory=Load)


@dataclass(eq=False)
class Value(LiveSource):
    """A value that is told with `together`, or not at all."""

    line: Line
    subject: str
    asked: Counter[str]
    fails: bool = False
    wanted_hz: float = 0.0
    together: list["Value"] = field(default_factory=list)
    type: ClassVar = "body.position"

    @property
    def own_hz(self) -> float:
        return self.wanted_hz

    async def read(self, due: Sequence[LiveSource]) -> Sequence[LiveSource]:
        assert current().work == "live"
        self.asked[self.subject] += 1
        began_at = asyncio.get_running_loop().time()
        await asyncio.sleep(ASKING_S)
        self.line.load.note(LIVE.work, began_at, asyncio.get_running_loop().time())
        if self.fails:
            raise PortNotOpen("gone", "wait")
        return [self, *(it for it in self.together if it in due)]


@dataclass
class Bench:
    hub: EventHub
    values: list[Value]
    asked: Counter[str]


@asynccontextmanager
async def bench(values: int = 2, share: float = 1.0, **options: Any) -> AsyncIterator[Bench]:
    line, hub, asked = Line(), EventHub(), Counter[str]()
    sources = [Value(line, f"/bodies/main.0{number}", asked, **options) for number in range(values)]
    task = asyncio.create_task(Sampler(cast("Any", line), hub.live, sources, share).run())
    await asyncio.sleep(1)
    try:
        yield Bench(hub, sources, asked)
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


@in_virtual_time
async def test_each_value_is_asked_for_as_often_as_it_is_wanted() -> None:
    async with bench() as it:
        assert not it.asked
        async with watching(it.hub, bodies=["00"], sample=10), watching(it.hub, sample=2):
            await asyncio.sleep(10)
        assert 99 <= it.asked["/bodies/main.00"] <= 101
        assert 20 <= it.asked["/bodies/main.01"] <= 21
        it.asked.clear()
        await asyncio.sleep(10)
        assert not it.asked


@in_virtual_time
async def test_where_the_time_is_short_all_that_are_watched_get_as_much() -> None:
    async with bench(values=9, share=0.1) as it:
        async with watching(it.hub, sample=50):
            await asyncio.sleep(90)
        assert 890 <= it.asked.total() <= 901
        assert max(it.asked.values()) - min(it.asked.values()) <= 1


@in_virtual_time
async def test_a_value_that_is_not_told_rests() -> None:
    async with bench() as it:
        it.values[0].fails = True
        async with watching(it.hub, sample=10):
            await asyncio.sleep(10)
        assert 9 <= it.asked["/bodies/main.00"] <= 10 / REST_S
        assert it.asked["/bodies/main.01"] > 90


@in_virtual_time
async def test_what_one_question_tells_of_others_is_not_asked_for_again() -> None:
    async with bench() as it:
        it.values[0].together = [it.values[1]]
        async with watching(it.hub, sample=10):
            await asyncio.sleep(10)
        assert 99 <= it.asked["/bodies/main.00"] <= 101
        assert not it.asked["/bodies/main.01"]


@in_virtual_time
async def test_what_is_under_way_is_asked_for_though_nobody_watches() -> None:
    async with bench() as it:
        it.values[1].wanted_hz = 5
        it.hub.live.demand_changes()
        await asyncio.sleep(10)
        assert 49 <= it.asked.total() == it.asked["/bodies/main.01"] <= 51
        it.values[1].wanted_hz = 0
        it.hub.live.demand_changes()
        await asyncio.sleep(10)
        assert it.asked.total() <= 52


@in_virtual_time
async def test_what_nobody_wants_any_more_is_not_asked_flat_out_where_nobody_has_said_so() -> None:
    async with bench(values=1) as it:
        it.values[0].wanted_hz = 10.0
        it.hub.live.demand_changes()
        await asyncio.sleep(1)
        it.values[0].wanted_hz = 0.0
        await asyncio.sleep(1)
        asked = it.asked.total()
        await asyncio.sleep(1)
        assert it.asked.total() == asked
