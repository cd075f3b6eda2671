"""Waiting tasks have turns: all of them, in their order, with pauses for the rest of the gateway."""

import asyncio
from collections.abc import Callable
from functools import partial

import pytest

from gateway.core.turns import LONGEST_PAUSE_S, PAUSE, SLICE, SLICE_S, Turns
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
