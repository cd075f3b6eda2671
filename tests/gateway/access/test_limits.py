"""The limits of one key."""

from contextlib import ExitStack

import pytest

from gateway.access.errors import LimitReached
from gateway.access.limits import KeyLimits, Rates, Usages, Use


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def begin(stack: ExitStack, usages: Usages, use: Use, times: int, key: str = "a") -> None:
    for _ in range(times):
        usages.begin(key, use)
        stack.callback(usages.end, key, use)


@pytest.mark.parametrize("use", [Use.SUBSCRIBER, Use.REQUEST])
def test_what_is_over_makes_room(use: Use) -> None:
    usages = Usages(KeyLimits(subscribers=2, requests=2))
    with ExitStack() as stack:
        begin(stack, usages, use, 2)
        with pytest.raises(LimitReached, match="has 2"):
            usages.begin("a", use)
        begin(stack, usages, use, 2, "b")
    with ExitStack() as stack:
        begin(stack, usages, use, 2)


def test_moves_are_so_many_in_a_second() -> None:
    clock = Clock()
    usages = Usages(KeyLimits(moves_per_s=3), clock)
    with ExitStack() as stack:
        begin(stack, usages, Use.MOVE, 3)
        with pytest.raises(LimitReached, match="3 moves"):
            usages.begin("a", Use.MOVE)
        begin(stack, usages, Use.REQUEST, 10)
    clock.now = 0.5
    with ExitStack() as stack:
        begin(stack, usages, Use.MOVE, 1)
        with pytest.raises(LimitReached):
            usages.begin("a", Use.MOVE)
    clock.now = 1000
    with ExitStack() as stack:
        begin(stack, usages, Use.MOVE, 3)
        with pytest.raises(LimitReached):
            usages.begin("a", Use.MOVE)


def test_moves_under_way_are_requests_under_way() -> None:
    usages = Usages(KeyLimits(requests=2))
    with ExitStack() as stack:
        begin(stack, usages, Use.MOVE, 2)
        for use in (Use.MOVE, Use.REQUEST):
            with pytest.raises(LimitReached):
                usages.begin("a", use)


@pytest.mark.parametrize("at_once", [1, 5])
def test_a_rate_lets_so_many_pass_and_then_so_many_a_second(at_once: int) -> None:
    now = 100.0
    rates = Rates(at_once, 2.0, lambda: now)
    assert [rates.passes("a") for _ in range(at_once + 2)] == [*at_once * [True], False, False]
    assert rates.passes("b")
    now += 0.5
    assert [rates.passes("a"), rates.passes("a")] == [True, False]
    now += 100
    assert [rates.passes("a") for _ in range(at_once + 1)] == [*at_once * [True], False]
