"""Waiting tasks have turns: all of them, in their order, with pauses for the rest of the gateway."""

import asyncio
from collections.abc import Callable
from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.events import BLOCK, LONGEST_PAUSE_S, PAUSE, SLICE, SLICE_S, EventRing, KeptEvent, Turns
from tests.virtual_time import run_virtual


class Work:
    """Turns that take some time, and a clock that shows it."""

    def __init__(self, turn_s: float = 0.0) -> None:
        self.now = 0.0
        self.had: list[tuple[int, float]] = []
        self.turns = Turns(lambda: self.now)
        self._turn_s = turn_s

    def turn(self, whose: int) -> Callable[[], None]:
        return partial(self._have, whose)

    def _have(self, whose: int) -> None:
        self.had.append((whose, asyncio.get_running_loop().time()))
        self.now += self._turn_s


def test_news_gives_a_turn_to_all_that_wait_and_to_each_once() -> None:
    async def story() -> None:
        work = Work()
        for whose in range(3 * SLICE):
            work.turns.at_news(whose, work.turn(whose))
        work.turns.news()
        work.turns.news()
        assert work.had == []
        await asyncio.sleep(1)
        assert [whose for whose, _ in work.had] == list(range(3 * SLICE))
        assert work.turns.idle

    run_virtual(story())


def test_a_turn_that_fails_takes_nobody_the_turns_to_come(caplog: pytest.LogCaptureFixture) -> None:
    def fail() -> None:
        raise ZeroDivisionError

    async def story() -> None:
        work = Work()
        work.turns.soon("a", fail)
        work.turns.soon("b", work.turn(1))
        await asyncio.sleep(1)
        work.turns.soon("b", work.turn(2))
        await asyncio.sleep(1)
        assert [whose for whose, _ in work.had] == [1, 2]

    run_virtual(story())
    assert "a turn has met a fault of the gateway itself" in caplog.text


def test_long_turns_end_a_slice_and_a_pause_follows() -> None:
    async def story() -> None:
        work = Work(SLICE_S)
        for whose in range(4):
            work.turns.soon(whose, work.turn(whose))
        await asyncio.sleep(1)
        times = [at for _, at in work.had]
        assert times[0] == times[1] < times[2] == times[3]
        assert times[2] - times[1] >= 2 * SLICE_S * PAUSE

    run_virtual(story())


def test_no_pause_is_long_though_the_process_was_suspended() -> None:
    async def story() -> None:
        work = Work(3600)
        for whose in range(2):
            work.turns.soon(whose, work.turn(whose))
        await asyncio.sleep(2 * LONGEST_PAUSE_S)
        assert [whose for whose, _ in work.had] == [0, 1]

    run_virtual(story())


def test_who_is_forgotten_has_no_turn() -> None:
    async def story() -> None:
        work = Work()
        work.turns.at_news(1, work.turn(1))
        work.turns.soon(2, work.turn(2))
        work.turns.forget(1)
        work.turns.forget(2)
        work.turns.news()
        await asyncio.sleep(1)
        assert work.had == []

    run_virtual(story())


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
