"""Live values: the newest of each, as often as asked for, and none without a watcher."""

import asyncio
from datetime import UTC, datetime

import pytest
from pydantic import BaseModel

from gateway.core.events import EventHub
from tests.plants import in_virtual_time
from tests.watching import watching

NOON = datetime(2026, 11, 21, 12, tzinfo=UTC)
POSITION, BODY, OTHER = "body.position", "/bodies/main.3F", "/bodies/main.01"


class Place(BaseModel):
    pulses: int


def make_hub() -> EventHub:
    return EventHub("0badcafe", clock=lambda: NOON)


def put(hub: EventHub, pulses: int, subject: str = BODY) -> None:
    hub.live.put(POSITION, subject, Place(pulses=pulses))


async def feed(hub: EventHub, hz: float, count: int, *subjects: str) -> None:
    for number in range(count):
        for subject in subjects or (BODY,):
            put(hub, number, subject)
        await asyncio.sleep(1 / hz)


@in_virtual_time
async def test_a_value_is_a_cloud_event_with_the_cursor_of_the_last_event() -> None:
    hub = make_hub()
    hub.publish("line.up", "/lines/main", {})
    async with watching(hub, sample=10) as reader:
        await asyncio.sleep(1)
        hub.live.put(POSITION, BODY, Place(pulses=7), at=asyncio.get_running_loop().time() - 0.25)
        await asyncio.sleep(1)
    [[event]] = reader.writes
    assert event == {
        "specversion": "1.0",
        "id": "0badcafe-live-000000000001",
        "source": "/motion-gateway",
        "type": "body.position",
        "subject": BODY,
        "time": "2026-11-21T11:59:59.750000Z",
        "datacontenttype": "application/json",
        "data": {"pulses": 7},
        "cursor": hub.cursor,
    }


@in_virtual_time
async def test_values_are_neither_numbered_nor_kept_among_the_events() -> None:
    hub = make_hub()
    async with watching(hub, sample=10):
        await feed(hub, 10, 20)
    assert hub.last == 0
    assert not (await hub.since()).events


@in_virtual_time
async def test_nobody_gets_values_more_often_than_asked_for() -> None:
    hub = make_hub()
    async with watching(hub, sample=2) as slow, watching(hub, sample=20) as fast:
        await feed(hub, 20, 200)
    assert 20 <= len(slow.writes) <= 21
    assert 198 <= len(fast.writes) <= 200
    assert all(len(write) == 1 for write in fast.writes)


@in_virtual_time
async def test_values_of_many_bodies_come_in_one_write() -> None:
    hub = make_hub()
    async with watching(hub, sample=5) as reader:
        await feed(hub, 5, 10, *(f"/bodies/main.{body:02X}" for body in range(120)))
    assert reader.pulses == [[number] * 120 for number in range(10)]


@in_virtual_time
async def test_who_reads_slowly_gets_the_newest_of_each_and_no_backlog() -> None:
    hub = make_hub()
    async with watching(hub, sample=50) as reader:
        reader.takes = False
        await feed(hub, 50, 5000, BODY, OTHER)
        reader.takes = True
        reader.on_room()
        await asyncio.sleep(1)
    assert reader.pulses == [[4999, 4999]]


@in_virtual_time
async def test_a_filter_is_one_for_values_too() -> None:
    hub = make_hub()
    async with (
        watching(hub, bodies=["01"], sample=10) as mine,
        watching(hub, types=["line.*"], sample=10) as none,
    ):
        put(hub, 1)
        put(hub, 2, OTHER)
        assert hub.live.rate(POSITION, OTHER) == 10
        assert hub.live.rate(POSITION, BODY) == 0
        await asyncio.sleep(1)
    assert (mine.pulses, none.pulses) == ([[2]], [])


@in_virtual_time
async def test_events_are_given_before_values() -> None:
    hub = make_hub()
    async with watching(hub, sample=10) as reader:
        put(hub, 1)
        for number in range(100):
            hub.publish("line.up", "/lines/main", {"n": number})
        await asyncio.sleep(1)
    types = [event["type"] for write in reader.writes for event in write]
    assert types == ["line.up"] * 100 + ["body.position"]


@in_virtual_time
async def test_the_rate_is_that_of_the_client_that_wants_most_and_ends_with_them() -> None:
    hub = make_hub()
    before = hub.live.demand
    assert hub.live.rate(POSITION, BODY) == 0
    async with watching(hub, sample=2):
        assert before.is_set()
        async with watching(hub, bodies=["3F"], sample=20):
            assert hub.live.rate(POSITION, BODY) == 20
        assert hub.live.rate(POSITION, BODY) == 2
        put(hub, 1)
    assert hub.live.rate(POSITION, BODY) == 0
    async with watching(hub, sample=2) as late:
        await asyncio.sleep(1)
    assert not late.writes


@in_virtual_time
async def test_without_a_sample_there_are_no_values() -> None:
    hub = make_hub()
    async with watching(hub, sample=10) as watcher, watching(hub) as reader:
        await feed(hub, 10, 5)
    assert len(watcher.writes) == 5
    assert not reader.writes


@in_virtual_time
async def test_the_list_gives_values_read_for_it() -> None:
    hub = make_hub()
    reading = asyncio.create_task(hub.values(["3F"], None, 10))
    await asyncio.sleep(0.5)
    put(hub, 3)
    assert [event.data for event in await reading] == [{"pulses": 3}]
    began = asyncio.get_running_loop().time()
    assert not await hub.values(["3F"], None, 10)
    assert asyncio.get_running_loop().time() - began == pytest.approx(1)


@in_virtual_time
async def test_who_watches_is_let_go_with_the_hub() -> None:
    hub = make_hub()
    async with watching(hub, sample=10):
        put(hub, 1)
        hub.close()
        await asyncio.sleep(1)
        assert hub.live.rate(POSITION, BODY) == 0
