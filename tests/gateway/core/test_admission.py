"""Admission of new work: allowed or not, and the reason."""

import asyncio
from collections.abc import Callable
from itertools import pairwise

import pytest

from gateway.core.admission import (
    BEAT_S,
    DOUBT_S,
    HELD_S,
    LATE_S,
    SUSPENDED_S,
    Admission,
    LoopWatch,
    boot_time,
)
from gateway.core.errors import GatewayEnding, HeldUp
from tests.plants import in_virtual_time


def test_where_nobody_watches_and_nothing_ends_everything_is_admitted() -> None:
    Admission().require()


def test_at_the_end_nothing_is() -> None:
    admission = Admission()
    admission.end()
    with pytest.raises(GatewayEnding) as refusal:
        admission.require()
    assert (refusal.value.moved, refusal.value.retryable) == ("no", True)


@in_virtual_time
async def test_what_may_have_come_while_the_gateway_was_suspended_is_not() -> None:
    now = 0.0
    watch = LoopWatch(lambda: now)
    watch.start()
    admission = Admission(watch)
    admission.require()
    now += SUSPENDED_S + 1.0
    with pytest.raises(HeldUp) as refusal:
        admission.require()
    assert (refusal.value.moved, refusal.value.retryable) == ("no", True)
    now += DOUBT_S
    admission.require()
    watch.close()


class Clock:
    """The loop's own clock, and the time in which the loop was held besides."""

    def __init__(self) -> None:
        self.held_s = 0.0

    def __call__(self) -> float:
        return asyncio.get_running_loop().time() + self.held_s

    def hold(self, seconds: float) -> None:
        self.held_s += seconds


def watched() -> tuple[LoopWatch, Clock, list[float]]:
    """A watch that has just begun, and what it will tell."""
    clock, told = Clock(), list[float]()
    watch = LoopWatch(clock)
    watch.on_held = told.append
    watch.start()
    return watch, clock, told


@in_virtual_time
async def test_a_loop_that_runs_has_nothing_to_tell() -> None:
    watch, _, told = watched()
    await asyncio.sleep(60.0)
    assert not told
    assert not watch.in_doubt()
    watch.close()


@pytest.mark.parametrize(("seconds", "is_told"), [(HELD_S - 0.01, False), (HELD_S + 0.1, True), (1.9, True)])
def test_a_held_loop_is_told_once_from_a_quarter_of_a_second_on(seconds: float, is_told: bool) -> None:
    @in_virtual_time
    async def story() -> None:
        watch, clock, told = watched()
        await asyncio.sleep(1.0)
        clock.hold(seconds)
        watch.check()
        assert not told  # how long it will be is not known yet
        await asyncio.sleep(1.0)
        assert told == ([pytest.approx(seconds, abs=BEAT_S)] if is_told else [])
        assert not watch.in_doubt()
        watch.close()

    story()


@pytest.mark.parametrize("first", [LoopWatch.check, LoopWatch.in_doubt, LoopWatch._beat])
def test_a_suspension_is_told_once_no_matter_who_comes_first(first: Callable[[LoopWatch], object]) -> None:
    @in_virtual_time
    async def story() -> None:
        watch, clock, told = watched()
        await asyncio.sleep(1.0)
        clock.hold(600.0)
        first(watch)
        assert told == [pytest.approx(600.0, abs=BEAT_S)]
        watch.check()
        await asyncio.sleep(1.0)
        assert len(told) == 1
        watch.close()

    story()


@in_virtual_time
async def test_after_a_suspension_nobody_knows_for_half_a_second_how_old_a_request_is() -> None:
    watch, clock, _ = watched()
    clock.hold(SUSPENDED_S + 1.0)
    assert watch.in_doubt()
    await asyncio.sleep(DOUBT_S - 0.01)
    assert watch.in_doubt()
    await asyncio.sleep(0.02)
    assert not watch.in_doubt()
    watch.close()


@in_virtual_time
async def test_a_loop_that_is_still_late_with_what_has_piled_up_is_in_doubt_for_longer() -> None:
    watch, clock, told = watched()
    clock.hold(SUSPENDED_S + 1.0)
    for _ in range(20):
        assert watch.in_doubt()
        clock.hold(LATE_S + 0.01)  # each turn of the loop takes this time
        await asyncio.sleep(BEAT_S + 0.01)
    await asyncio.sleep(DOUBT_S)
    assert not watch.in_doubt()
    assert len(told) == 1
    watch.close()


@in_virtual_time
async def test_who_fails_when_told_does_not_stop_the_heart() -> None:
    watch, clock, _ = watched()
    errors: list[object] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: errors.append(context))

    def fail(_: float) -> None:
        raise ValueError("a test")

    watch.on_held = fail
    clock.hold(1.0)
    await asyncio.sleep(BEAT_S + 0.01)
    told: list[float] = []
    watch.on_held = told.append
    clock.hold(1.0)
    await asyncio.sleep(BEAT_S + 0.01)
    assert len(told) == len(errors) == 1
    watch.close()


@in_virtual_time
async def test_a_watch_that_was_never_started_or_is_closed_notices_nothing() -> None:
    clock, told = Clock(), list[float]()
    watch = LoopWatch(clock)
    watch.on_held = told.append
    clock.hold(100.0)
    assert not watch.in_doubt()
    watch.start()
    watch.close()
    clock.hold(100.0)
    assert not watch.in_doubt()
    assert not told


def test_the_clock_of_the_computer_goes_on_and_never_back() -> None:
    assert all(one <= other for one, other in pairwise(boot_time() for _ in range(100)))
