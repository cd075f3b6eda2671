"""Packed or not, an event is read as it was kept."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.event_ring import BLOCK, EventRing, KeptEvent


def an_event(number: int) -> KeptEvent:
    return KeptEvent("line.up", f"/lines/ライン{number}", f'{{"n":{number},"text":"a\\nb"}}')


@given(capacity=st.integers(1, 3 * BLOCK), count=st.integers(0, 6 * BLOCK))
def test_the_newest_are_kept_and_no_others(capacity: int, count: int) -> None:
    ring = EventRing(capacity)
    for number in range(1, count + 1):
        ring.append(an_event(number))
    assert (ring.first, ring.last) == (max(1, count - capacity + 1), count)
    kept = range(ring.first, ring.last + 1)
    assert [ring[number] for number in kept] == [an_event(number) for number in kept]
    assert len(ring._packed) <= capacity // BLOCK + 2


@pytest.mark.parametrize("capacity", [1, BLOCK - 1, BLOCK, BLOCK + 1])
def test_events_are_read_while_others_go(capacity: int) -> None:
    ring = EventRing(capacity)
    for number in range(1, 5 * BLOCK):
        ring.append(an_event(number))
        assert ring[ring.first] == an_event(ring.first)
        assert ring[number] == an_event(number)


def test_a_packed_event_takes_a_fraction_of_its_text() -> None:
    ring = EventRing(10 * BLOCK)
    for number in range(10 * BLOCK):
        ring.append(KeptEvent("body.move.started", "/bodies/line.3F", f'{{"position":{number}}}' * 40))
    assert sum(map(len, ring._packed)) < sum(len(ring[number].json) for number in range(1, 10 * BLOCK)) / 8
