"""The newest events of all gateways, read by clients that break off, lag behind, and come from elsewhere."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fleet.feed import MAX_BACKLOG, Feed, PlantEvent, SlowClient, event_of
from gateway.core.events import GAP


def event(gateway: str, number: int, epoch: str = "0000000a") -> PlantEvent:
    cursor = f"{epoch}-{number:012d}"
    text = json.dumps(
        {"id": cursor, "type": "body.online", "subject": "/bodies/line1.3F", "cursor": cursor, "data": {}},
        separators=(",", ":"),
    )
    return event_of(gateway, cursor, cursor, text)


def filled(*events: PlantEvent, capacity: int = 1000) -> Feed:
    feed = Feed(capacity)
    for it in events:
        feed.add(it)
    return feed


def everything(_event: PlantEvent) -> bool:
    return True


def numbers(events: list[PlantEvent]) -> list[tuple[str, int]]:
    return [(it.gateway, int(it.cursor.rpartition("-")[2])) for it in events]


def test_an_event_keeps_its_words_and_gets_its_gateway() -> None:
    told = json.loads(event("s1", 7).json)
    assert told == {
        "gateway": "s1",
        "id": "0000000a-000000000007",
        "type": "body.online",
        "subject": "/bodies/s1:line1.3F",
        "cursor": "0000000a-000000000007",
        "data": {},
    }


def test_a_client_without_a_cursor_reads_what_is_new() -> None:
    feed = filled(event("s1", 1))
    reader = feed.reader(None, everything)
    feed.add(event("s2", 1))
    assert numbers(reader.take()) == [("s2", 1)]


def test_a_cursor_is_continued_gateway_by_gateway() -> None:
    feed = filled(*(event(name, number) for number in (1, 2, 3) for name in ("s1", "s2")))
    after = {"s1": "0000000a-000000000003", "s2": "0000000a-000000000001"}
    reader = feed.reader(after, everything)
    assert numbers(reader.take()) == [("s2", 2), ("s2", 3)]
    assert reader.cursor == "s1:0000000a-000000000003,s2:0000000a-000000000003"


def test_what_the_stream_tells_again_after_its_loss_is_no_news() -> None:
    feed = filled(event("s1", 1), event("s1", 2))
    assert [feed.add(event("s1", number)) for number in (1, 2, 3)] == [False, False, True]
    assert feed.holes == 0


def test_a_hole_of_one_gateway_is_that_ones_gap_and_the_others_go_on() -> None:
    feed = filled(event("s1", 1), event("s2", 1), event("s1", 5), event("s2", 2))
    read = feed.reader({}, everything).take()
    assert [(it.gateway, it.type) for it in read if it.type == GAP] == [("s1", GAP)]
    data = json.loads(next(it.json for it in read if it.type == GAP))["data"]
    assert data == {"requested": "0000000a-000000000001", "first_available": "0000000a-000000000005"}
    assert [it for it in numbers(read) if it[0] == "s2"] == [("s2", 1), ("s2", 2)]


def test_a_cursor_that_is_too_old_is_answered_with_a_gap() -> None:
    feed = filled(*(event("s1", number) for number in range(1, 21)), capacity=10)
    reader = feed.reader({"s1": "0000000a-000000000005"}, everything)
    read = [*reader.take(), *reader.take()]
    assert read[0].type == GAP
    assert numbers(read[1:]) == [("s1", number) for number in range(11, 21)]


def test_another_epoch_is_no_hole() -> None:
    feed = filled(event("s1", 9), event("s1", 4, "0000000b"))
    assert feed.holes == 0


def test_a_cursor_of_a_plant_process_that_was_ahead_repeats_nothing() -> None:
    feed = filled(event("s1", 1))
    reader = feed.reader({"s1": "0000000a-000000000002"}, everything)
    assert reader.take() == []
    feed.add(event("s1", 2))
    feed.add(event("s1", 3))
    assert numbers(reader.take())[-1] == ("s1", 3)


def test_a_client_that_falls_behind_is_told_where_to_go_on() -> None:
    feed = Feed(2 * MAX_BACKLOG)
    feed.add(event("s1", 1))
    reader = feed.reader(None, everything)
    reader.take()
    for number in range(2, MAX_BACKLOG + 4):
        feed.add(event("s1", number))
    with pytest.raises(SlowClient) as slow:
        reader.take()
    assert slow.value.cursor == "s1:0000000a-000000000001"


@given(st.lists(st.sampled_from(["s1", "s2", "s3"]), max_size=60), st.integers(1, 7), st.data())
def test_a_client_that_breaks_off_anywhere_loses_and_doubles_nothing(
    order: list[str], most: int, data: st.DataObject
) -> None:
    feed, counts = Feed(), dict.fromkeys(("s1", "s2", "s3"), 0)
    sent = []
    for name in order:
        counts[name] += 1
        sent.append((name, counts[name]))
        feed.add(event(name, counts[name]))
    read: list[tuple[str, int]] = []
    reader = feed.reader({}, everything)
    while taken := reader.take(most):
        read += numbers(taken)
        if data.draw(st.booleans()):
            from fleet.cursors import read as places_of

            reader = feed.reader(places_of(reader.cursor), everything)
    assert sorted(read) == sorted(sent)
    assert all(
        [it for it in read if it[0] == name] == [it for it in sent if it[0] == name] for name in counts
    )
