import asyncio
import gc
import json
from collections.abc import Callable, Iterable
from datetime import UTC, datetime, timedelta
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.errors import InvalidRequest
from gateway.core.events import (
    BATCH,
    GAP,
    MAX_BACKLOG,
    MAX_PAGE,
    SNAPSHOT,
    CloudEvent,
    Event,
    EventHub,
    Filter,
    SlowConsumer,
    Subscription,
    Turns,
    Writer,
)
from gateway.rorze.stops import StopReport
from tests.virtual_time import run_virtual

NOON = datetime(2026, 11, 21, 12, tzinfo=UTC)


def make_hub(capacity: int = 100_000) -> EventHub:
    return EventHub("0badcafe", capacity, clock=lambda: NOON)


def publish(hub: EventHub, count: int, type_: str = "line.up") -> None:
    for number in range(hub.last + 1, hub.last + 1 + count):
        hub.publish(type_, "/lines/main", {"n": number})


async def take(subscription: Subscription, count: int) -> list[Event]:
    return [await anext(subscription) for _ in range(count)]


def numbers(events: Iterable[Event]) -> list[int]:
    return [event.number for event in events]


def joined(events: Iterable[Event]) -> bytes:
    return "".join(event.json for event in events).encode()


class TestAnEvent:
    def test_is_a_cloud_event(self) -> None:
        event = make_hub().publish("body.move.started", "/bodies/main.3F", {"pattern": None}, "move-1")
        assert json.loads(event.json) == {
            "specversion": "1.0",
            "id": "0badcafe-000000000001",
            "source": "/motion-gateway",
            "type": "body.move.started",
            "subject": "/bodies/main.3F",
            "time": "2026-11-21T12:00:00Z",
            "datacontenttype": "application/json",
            "sequence": "000000000001",
            "cursor": "0badcafe-000000000001",
            "correlationid": "move-1",
            "data": {"pattern": None},
        }
        assert CloudEvent.model_validate_json(event.json).model_dump_json() == event.json

    def test_has_no_correlation_rather_than_a_null(self) -> None:
        assert "correlationid" not in json.loads(make_hub().publish("line.up", "/lines/main", {}).json)

    def test_is_written_once_for_all_clients(self) -> None:
        hub = make_hub()
        event = hub.publish("line.up", "/lines/main", {})
        assert hub.event(1).json is event.json

    def test_tells_what_was_when_it_happened(self) -> None:
        hub, data = make_hub(), {"n": 1}
        hub.publish("line.up", "/lines/main", data)
        data["n"] = 2
        assert hub.event(1).data == {"n": 1}

    def test_may_tell_a_record_of_the_gateway(self) -> None:
        report = StopReport(body_id="main.3F", position=5)
        event = make_hub().publish("body.stop.confirmed", "/bodies/main.3F", report)
        assert event.data == report.model_dump(mode="json")

    def test_has_no_number_that_json_does_not_know(self) -> None:
        assert make_hub().publish("line.up", "/lines/main", {"x": float("nan")}).data == {"x": None}


class TestNumbers:
    def test_go_up_by_one_and_sort_as_text(self) -> None:
        hub = make_hub()
        publish(hub, 1001)
        sequences = [json.loads(hub.event(number).json)["sequence"] for number in range(1, 1002)]
        assert [int(sequence) for sequence in sequences] == list(range(1, 1002))
        assert sequences == sorted(sequences)

    def test_do_not_depend_on_the_clock(self) -> None:
        times = iter([NOON, NOON - timedelta(days=365), NOON])
        hub = EventHub(clock=lambda: next(times))
        publish(hub, 3)
        assert [hub.event(number).number for number in (1, 2, 3)] == [1, 2, 3]

    def test_begin_anew_in_a_new_epoch(self) -> None:
        assert EventHub().epoch != EventHub().epoch
        assert EventHub().cursor.endswith("-000000000000")

    def test_only_the_newest_events_are_kept(self) -> None:
        hub = make_hub(capacity=3)
        publish(hub, 5)
        assert (hub.first, hub.last) == (3, 5)
        assert [hub.event(number).data["n"] for number in (3, 4, 5)] == [3, 4, 5]

    def test_of_events_that_are_kept_concern_no_garbage_collector(self) -> None:
        hub = make_hub()
        publish(hub, 1)
        gc.collect()
        before = len(gc.get_objects())
        publish(hub, 10_000)
        gc.collect()
        assert len(gc.get_objects()) - before < 100


class TestASubscription:
    def test_begins_now_and_sees_each_new_event(self) -> None:
        async def story() -> None:
            hub = make_hub()
            publish(hub, 3)
            subscription = hub.subscribe()
            publish(hub, 1)
            assert numbers(await take(subscription, 1)) == [4]
            waiting = asyncio.ensure_future(anext(subscription))
            await asyncio.sleep(1)
            assert not waiting.done()
            publish(hub, 1)
            assert (await waiting).number == 5

        run_virtual(story())

    def test_goes_on_after_a_cursor_with_no_hole_and_no_double(self) -> None:
        async def story() -> None:
            hub = make_hub()
            publish(hub, 10)
            reader = asyncio.ensure_future(take(hub.subscribe(hub.event(4).cursor), 9))
            await asyncio.sleep(0)
            publish(hub, 3)
            assert numbers(await reader) == [5, 6, 7, 8, 9, 10, 11, 12, 13]

        run_virtual(story())

    def test_begins_with_the_first_event_when_asked_from_the_start(self) -> None:
        async def story() -> None:
            hub = make_hub()
            start = hub.cursor
            publish(hub, 2)
            assert numbers(await take(hub.subscribe(start), 2)) == [1, 2]

        run_virtual(story())

    @pytest.mark.parametrize(
        "lost", ["0badcafe-000000000001", "deadbeef-000000000004", "0badcafe-000000000099"]
    )
    def test_hears_of_a_gap_when_its_cursor_cannot_be_continued(self, lost: str) -> None:
        async def story() -> None:
            hub = make_hub(capacity=3)
            publish(hub, 5)
            subscription = hub.subscribe(lost, bodies=["3F"], types=["line.down"])
            gap = await anext(subscription)
            assert gap.type == GAP
            assert gap.data == {"requested": lost, "first_available": "0badcafe-000000000003"}
            assert json.loads(gap.json)["id"] != json.loads(hub.event(3).json)["id"]
            assert numbers(await take(hub.subscribe(gap.cursor), 3)) == [3, 4, 5]

        run_virtual(story())

    def test_is_told_after_a_gap_how_all_is_that_it_wants(self) -> None:
        async def story() -> None:
            hub = make_hub(capacity=2)
            hub.take_snapshot = lambda wanted, as_of: {"of": sorted(wanted.bodies), "as_of": as_of}
            publish(hub, 5)
            old = "0badcafe-000000000001"
            gap, snapshot, *rest = await take(hub.subscribe(old), 4)
            assert (gap.type, snapshot.type) == (GAP, SNAPSHOT)
            assert snapshot.data == {"of": [], "as_of": "0badcafe-000000000005"}
            assert numbers(rest) == [4, 5]
            assert json.loads(snapshot.json)["id"] != json.loads(gap.json)["id"]
            page = await hub.since(old, bodies=["3F"], limit=1)
            assert [event.type for event in page.events] == [GAP, SNAPSHOT], "on one page, however short"
            assert page.events[1].data["of"] == ["3F"]
            assert numbers((await hub.since(page.cursor)).events) == [4, 5]

        run_virtual(story())

    def test_begins_with_a_snapshot_if_asked_and_goes_on_after_its_cursor(self) -> None:
        async def story() -> None:
            hub = make_hub()
            hub.take_snapshot = lambda _wanted, as_of: {"as_of": as_of}
            publish(hub, 2)
            now = hub.subscribe(snapshot=True)
            snapshot = await anext(now)
            assert (snapshot.type, snapshot.cursor) == (SNAPSHOT, hub.cursor)
            publish(hub, 1)
            assert numbers(await take(now, 1)) == [3]
            earlier, *rest = await take(hub.subscribe("0badcafe-000000000001", snapshot=True), 3)
            assert (earlier.type, earlier.data["as_of"]) == (SNAPSHOT, "0badcafe-000000000003")
            assert numbers(rest) == [2, 3], "what was missed comes all the same"

        run_virtual(story())

    def test_has_one_snapshot_after_a_gap_asked_or_not(self) -> None:
        async def story() -> None:
            hub = make_hub(capacity=2)
            hub.take_snapshot = lambda _wanted, _as_of: {}
            publish(hub, 5)
            events = await take(hub.subscribe("0badcafe-000000000001", snapshot=True), 4)
            assert [event.type for event in events[:2]] == [GAP, SNAPSHOT]
            assert numbers(events[2:]) == [4, 5]

        run_virtual(story())

    def test_the_cursor_just_before_the_oldest_event_is_no_gap(self) -> None:
        async def story() -> None:
            hub = make_hub(capacity=3)
            publish(hub, 5)
            assert numbers(await take(hub.subscribe("0badcafe-000000000002"), 3)) == [3, 4, 5]

        run_virtual(story())

    def test_of_an_old_epoch_at_a_fresh_gateway_gets_the_gap_at_once(self) -> None:
        async def story() -> None:
            hub = make_hub()
            gap = await anext(hub.subscribe("deadbeef-000000000004"))
            assert gap.data["first_available"] == "0badcafe-000000000001"

        run_virtual(story())

    def test_overtaken_while_it_replays_hears_of_the_gap_in_its_place(self) -> None:
        async def story() -> None:
            hub = make_hub(capacity=4)
            publish(hub, 4)
            subscription = hub.subscribe("0badcafe-000000000000")
            assert numbers(await take(subscription, 2)) == [1, 2]
            publish(hub, 4)
            gap, *rest = await take(subscription, 5)
            assert (gap.type, gap.data["requested"]) == (GAP, "0badcafe-000000000002")
            assert numbers(rest) == [5, 6, 7, 8]

        run_virtual(story())

    def test_that_cannot_keep_up_ends_and_can_be_resumed_without_loss(self) -> None:
        async def story() -> None:
            hub = make_hub()
            subscription = hub.subscribe()
            reader = asyncio.ensure_future(anext(subscription))
            await asyncio.sleep(0)
            publish(hub, 1)
            assert (await reader).number == 1
            publish(hub, MAX_BACKLOG + 1)
            with pytest.raises(SlowConsumer) as slow:
                await anext(subscription)
            assert slow.value.cursor == "0badcafe-000000000001"
            assert (await anext(hub.subscribe(slow.value.cursor))).number == 2

        run_virtual(story())

    def test_may_be_as_far_behind_as_the_backlog_allows(self) -> None:
        async def story() -> None:
            hub = make_hub()
            subscription = hub.subscribe()
            reader = asyncio.ensure_future(take(subscription, MAX_BACKLOG))
            await asyncio.sleep(0)
            publish(hub, MAX_BACKLOG)
            assert numbers(await reader) == list(range(1, MAX_BACKLOG + 1))

        run_virtual(story())

    def test_that_replays_is_not_slow_however_far_behind(self) -> None:
        async def story() -> None:
            hub = make_hub()
            publish(hub, 3 * MAX_BACKLOG)
            subscription = hub.subscribe("0badcafe-000000000000")
            assert len(await take(subscription, 3 * MAX_BACKLOG)) == 3 * MAX_BACKLOG

        run_virtual(story())

    def test_sleeps_through_events_it_does_not_want(self) -> None:
        async def story() -> None:
            hub = make_hub(capacity=10)
            subscription = hub.subscribe(types=["line.down"])
            reader = asyncio.ensure_future(anext(subscription))
            for _ in range(MAX_BACKLOG):
                await asyncio.sleep(1)
                publish(hub, 2)
            await asyncio.sleep(1)
            assert subscription.cursor == hub.cursor
            publish(hub, 1, "line.down")
            assert (await reader).type == "line.down"

        run_virtual(story())

    def test_at_one_place_with_one_filter_shares_a_batch_and_what_is_written_of_it(self) -> None:
        async def story() -> None:
            hub = make_hub()
            one, other = (hub.subscribe(types=["line.*"]) for _ in range(2))
            publish(hub, 3)
            first, second = await one.next_batch(), await other.next_batch()
            assert first is not None
            assert first is second
            assert numbers(first.events) == [1, 2, 3]
            assert first.written(joined) is first.written(joined)

        run_virtual(story())

    def test_is_not_slow_because_its_turn_comes_late(self) -> None:
        async def story() -> None:
            hub = make_hub()
            subscription = hub.subscribe()
            reader = asyncio.ensure_future(take(subscription, 2 * MAX_BACKLOG))
            await asyncio.sleep(0)
            publish(hub, 2 * MAX_BACKLOG)
            assert numbers(await reader) == list(range(1, 2 * MAX_BACKLOG + 1))

        run_virtual(story())

    def test_lets_the_rest_of_the_gateway_run_while_it_replays(self) -> None:
        async def story() -> None:
            hub = make_hub()
            hub.turns = Turns(clock=lambda: 0.0)
            publish(hub, 10 * BATCH)
            read_at_each_turn: list[int] = []
            subscription = hub.subscribe("0badcafe-000000000000")

            async def read() -> None:
                while subscription.cursor != hub.cursor:
                    await subscription.next_batch()

            reader = asyncio.ensure_future(read())
            while not reader.done():
                read_at_each_turn.append(int(subscription.cursor[-12:]))
                await asyncio.sleep(0)
            assert max(after - before for before, after in pairwise(read_at_each_turn)) == BATCH

        run_virtual(story())

    def test_given_up_while_it_waits_loses_nothing_and_leaves_nothing_behind(self) -> None:
        async def story() -> None:
            hub = make_hub()
            subscription = hub.subscribe()
            with pytest.raises(TimeoutError):
                await asyncio.wait_for(anext(subscription), 1)
            assert hub.turns.idle
            publish(hub, 1)
            assert (await anext(subscription)).number == 1

        run_virtual(story())

    def test_cancelled_in_the_turn_of_an_event_takes_it_the_next_time(self) -> None:
        async def story() -> None:
            hub = make_hub()
            subscription = hub.subscribe()
            reader = asyncio.ensure_future(anext(subscription))
            await asyncio.sleep(0)
            reader.cancel()
            publish(hub, 2)
            with pytest.raises(asyncio.CancelledError):
                await reader
            assert numbers(await take(subscription, 2)) == [1, 2]

        run_virtual(story())

    @given(
        capacity=st.integers(1, 20),
        already=st.integers(0, 30),
        cursor=st.integers(0, 40),
        bursts=st.lists(st.integers(0, 12), max_size=6),
        types=st.lists(st.sampled_from(["line.up", "line.down"]), min_size=1),
    )
    def test_sees_every_event_once_and_in_order_but_for_what_its_gaps_tell(
        self, capacity: int, already: int, cursor: int, bursts: list[int], types: list[str]
    ) -> None:
        async def story() -> None:
            hub = make_hub(capacity)
            seen: list[Event] = []

            async def read() -> None:
                subscription = hub.subscribe(f"0badcafe-{cursor:012d}", types=["line.down"])
                while True:
                    seen.append(await anext(subscription))

            def burst(count: int) -> None:
                for _ in range(count):
                    hub.publish(types[hub.last % len(types)], "/lines/main", {})

            burst(already)
            reader = asyncio.ensure_future(read())
            for count in bursts:
                await asyncio.sleep(1)
                burst(count)
            await asyncio.sleep(1)
            reader.cancel()
            await asyncio.wait([reader])

            wanted = [n for n in range(1, hub.last + 1) if types[(n - 1) % len(types)] == "line.down"]
            position = cursor
            for event in seen:
                if event.type != GAP:
                    assert event.number == next(n for n in wanted if n > position)
                position = event.number
            assert not [n for n in wanted if n > position]

        run_virtual(story())


class TestTheList:
    def test_gives_what_came_after_a_cursor_and_where_to_read_on(self) -> None:
        async def story() -> None:
            hub = make_hub()
            publish(hub, 5)
            page = await hub.since(hub.event(2).cursor, limit=2)
            assert numbers(page.events) == [3, 4]
            page = await hub.since(page.cursor)
            assert numbers(page.events) == [5]
            assert page.cursor == hub.cursor
            assert (await hub.since(page.cursor)).events == []

        run_virtual(story())

    def test_begins_with_the_oldest_event_and_has_no_page_without_end(self) -> None:
        async def story() -> None:
            hub = make_hub(capacity=MAX_PAGE + 5)
            publish(hub, MAX_PAGE + 10)
            page = await hub.since(limit=10 * MAX_PAGE)
            assert numbers(page.events) == list(range(6, MAX_PAGE + 6))

        run_virtual(story())

    def test_goes_past_what_is_not_wanted(self) -> None:
        async def story() -> None:
            hub = make_hub()
            publish(hub, 300)
            page = await hub.since(types=["line.down"])
            assert (page.events, page.cursor) == ([], hub.cursor)

        run_virtual(story())

    def test_tells_of_a_gap_as_an_event_among_the_others(self) -> None:
        async def story() -> None:
            hub = make_hub(capacity=2)
            publish(hub, 5)
            page = await hub.since("0badcafe-000000000001")
            assert [(event.type, event.number) for event in page.events] == [
                (GAP, 3),
                ("line.up", 4),
                ("line.up", 5),
            ]

        run_virtual(story())


class TestAFilter:
    @pytest.mark.parametrize(
        ("bodies", "subject", "passes"),
        [
            (["3F"], "/bodies/main.3F", True),
            (["3f"], "/bodies/main.3F", True),
            (["MAIN.3f"], "/bodies/main.3F", True),
            (["other.3F"], "/bodies/main.3F", False),
            (["00", "3F"], "/bodies/main.3F", True),
            (["80"], "/groups/main.80", True),
            (["3F"], "/lines/main", False),
            (["r1"], "/robots/r1", True),
            (["R1"], "/robots/r1", True),
            (["r1"], "/robots/r1/units/2", True),
            (["r1/units/2"], "/robots/r1/units/2", True),
            (["r1/Units/2"], "/robots/r1/units/2", True),
            (["r1/units/1"], "/robots/r1/units/2", False),
            (["r1/units/2"], "/robots/r1", False),
            (["r10"], "/robots/r1", False),
            (["r1"], "/robots/r10/units/1", False),
            (["3F", "r1"], "/robots/r1", True),
            (["main"], "/lines/main", False),
            (["main"], "/bodies/main.3F", False),
            (["events"], "/events", False),
            ([], "/lines/main", True),
            (None, "/lines/main", True),
        ],
    )
    def test_by_body(self, bodies: list[str] | None, subject: str, passes: bool) -> None:
        event = make_hub().publish("line.up", subject, {})
        assert Filter.of(bodies).wants(event) is passes

    @pytest.mark.parametrize(
        ("types", "passes"),
        [
            (["body.move.started"], True),
            (["body.move.*"], True),
            (["body.*"], True),
            (["line.*", "body.move.*"], True),
            (["body.move"], False),
            (["body.mov.*"], False),
            (["body.move.started.*"], False),
            ([], True),
        ],
    )
    def test_by_type(self, types: list[str], passes: bool) -> None:
        event = make_hub().publish("body.move.started", "/bodies/main.3F", {})
        assert Filter.of(types=types).wants(event) is passes

    @pytest.mark.parametrize(
        "body",
        [
            "",
            "3",
            "3FF",
            "3G",
            "a.b.3F",
            ".3F",
            "３F",
            "r1/",
            "r1/units",
            "r1/units/x",
            "/robots/r1",
            "ſ1",
            "r_1",
        ],
    )
    def test_of_something_that_is_no_address_is_refused(self, body: str) -> None:
        with pytest.raises(InvalidRequest, match="no address of a body or robot"):
            make_hub().subscribe(bodies=[body])

    @pytest.mark.parametrize("type_", ["", "*", ".*", "body.*.started", "body.", "Body", "body.mo*"])
    def test_of_something_that_is_no_type_is_refused(self, type_: str) -> None:
        with pytest.raises(InvalidRequest, match="no type of events"):
            make_hub().subscribe(types=[type_])


@given(st.text() | st.from_regex("[0-9a-f]{0,9}-[0-9]{0,14}", fullmatch=True))
def test_any_text_is_a_cursor_or_an_invalid_request(text: str) -> None:
    hub = make_hub()
    head, _, tail = text.partition("-")
    if len(head) == 8 and len(tail) == 12 and text.isascii() and tail.isdigit() and int(head, 16) >= 0:
        assert hub.subscribe(text).cursor == hub.cursor
    else:
        with pytest.raises(InvalidRequest, match="is no cursor"):
            hub.subscribe(text)


def test_what_happens_goes_on_where_a_listener_meets_a_fault(
    caplog: pytest.LogCaptureFixture,
) -> None:
    def fail(_: Event) -> None:
        raise ZeroDivisionError

    hub, heard = make_hub(), list[Event]()
    hub.listeners += [fail, heard.append]
    publish(hub, 2)
    assert numbers(heard) == [1, 2]
    assert "an event has met a fault of the gateway itself" in caplog.text


class Outlet:
    """Takes nothing: it fails."""

    def __init__(self) -> None:
        self.takes = True
        self.on_room: Callable[[], None] = lambda: None
        self.writer: Writer = joined

    def write(self, _: bytes, /) -> None:
        raise ZeroDivisionError


def test_a_delivery_that_meets_a_fault_ends_so_that_its_client_can_read_on() -> None:
    async def story() -> None:
        hub = make_hub()
        delivery = asyncio.create_task(hub.subscribe().deliver(Outlet()))
        await asyncio.sleep(1)
        other = hub.subscribe()
        publish(hub, 1)
        with pytest.raises(ZeroDivisionError):
            await asyncio.wait_for(delivery, 1)
        assert numbers(await take(other, 1)) == [1]

    run_virtual(story())
