"""One axis on its way."""

from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulator.fics.motion import Ramps, glide

SLOW_START = Ramps(10.0, 100.0, 200.0, 100.0)


def test_a_long_move_ramps_up_runs_and_ramps_down() -> None:
    way = glide(0.0, 200.0, SLOW_START, 5.0)
    # 0.45 s and 24.75 units up, 0.9 s and 49.5 units down, the rest at 100 units/s.
    assert way.ends_at == pytest.approx(5.0 + 0.45 + 0.9 + (200 - 24.75 - 49.5) / 100)
    assert way.place(5.45) == pytest.approx(24.75)
    assert way.speed(5.45) == pytest.approx(100.0)
    assert way.speed(5.0) == 10.0
    assert way.place(way.ends_at) == 200.0
    assert way.speed(way.ends_at) == 0.0


def test_a_short_move_never_reaches_its_speed() -> None:
    way = glide(0.0, -20.0, SLOW_START, 0.0)
    fastest = max(way.speed(way.ends_at * share / 1000) for share in range(1000))
    assert fastest == pytest.approx((10.0**2 + 20 / (1 / 400 + 1 / 200)) ** 0.5, rel=1e-2)
    assert way.place(way.ends_at) == -20.0


def test_an_s_curve_takes_as_long_and_is_slower_at_first() -> None:
    straight = glide(0.0, 200.0, SLOW_START, 0.0)
    curved = glide(0.0, 200.0, Ramps(10.0, 100.0, 200.0, 100.0, s_curve=True), 0.0)
    assert curved.ends_at == straight.ends_at
    assert curved.place(0.45) == pytest.approx(straight.place(0.45))
    assert curved.place(0.1) < straight.place(0.1)
    assert curved.speed(0.225) == pytest.approx(55.0)


def test_without_ramps_the_speed_is_there_at_once() -> None:
    way = glide(3.0, 8.0, Ramps(0.0, 10.0, inf, inf), 1.0)
    assert way.ends_at == 1.5
    assert way.place(1.2) == pytest.approx(5.0)


def test_no_way_takes_no_time() -> None:
    assert glide(7.0, 7.0, SLOW_START, 2.0).ends_at == 2.0


def test_braking_ends_after_the_ramp_and_short_of_the_target() -> None:
    braked = glide(0.0, 200.0, SLOW_START, 0.0).braked(1.0)
    assert braked.ends_at == pytest.approx(1.9)
    assert braked.target == pytest.approx(24.75 + 55.0 + 49.5)


def test_braking_on_the_last_ramp_changes_nothing() -> None:
    way = glide(0.0, 200.0, SLOW_START, 0.0)
    assert way.braked(way.ends_at - 0.3).target == pytest.approx(200.0)


def test_the_moment_at_a_place_is_found() -> None:
    way = glide(0.0, -200.0, SLOW_START, 0.0)
    assert way.place(way.time_at(-77.0)) == pytest.approx(-77.0)
    assert way.time_at(-201.0) == inf


speeds, rates = st.floats(0.1, 1e4), st.floats(0.1, 1e5)


@given(
    st.floats(-1e5, 1e5), st.floats(-1e5, 1e5), speeds, speeds, rates, rates, st.booleans(), st.floats(0, 1)
)
def test_every_move_gets_there_without_jumps_and_never_too_fast(
    origin: float, target: float, low: float, high: float, up: float, down: float, curve: bool, share: float
) -> None:
    way = glide(origin, target, Ramps(low, high, up, down, curve), 0.0)
    moment = way.ends_at * share
    assert way.place(way.ends_at) == target
    assert min(origin, target) - 1e-6 <= way.place(moment) <= max(origin, target) + 1e-6
    assert way.speed(moment) <= high * (1 + 1e-9)
    stopped = way.braked(moment)
    assert stopped.place(moment) == pytest.approx(way.place(moment), abs=1e-6)
    assert min(origin, target) - 1e-6 <= stopped.target <= max(origin, target) + 1e-6
