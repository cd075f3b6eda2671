from math import nextafter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.rorze.profile import SpeedParameters, plan, ramp_pulses, ramp_time_s, steady
from simulator.rorze.motion import PulseTrain

UP = SpeedParameters(low=5_000, high=50_000, acceleration=70_000, rising=30, falling=30)
DOWN = SpeedParameters(low=50, high=50_000, acceleration=95_000, rising=50, falling=20)
HARD = SpeedParameters(low=500, high=50_000, acceleration=1_000_000, rising=50, falling=50)
SOFT = SpeedParameters(low=10, high=50_000, acceleration=5_000, rising=50, falling=50)

START = 1_234.5


def long_move() -> PulseTrain:
    return PulseTrain(plan(200_000, UP, DOWN), 1, START)


def moment(train: PulseTrain, pulses: int) -> float:
    found = train.time_when(pulses)
    assert found is not None
    return found


def end_of(train: PulseTrain) -> float:
    assert train.ends_at is not None
    return train.ends_at


def test_a_train_runs_from_its_start_to_its_last_pulse() -> None:
    train = PulseTrain(plan(50_000, UP, DOWN), -1, START)
    assert train.started_at == START
    assert train.running(START)
    assert (train.emitted(START), train.displacement(end_of(train))) == (0, -50_000)
    assert not train.running(end_of(train))
    assert train.speed(end_of(train)) == 0


def test_a_decelerating_stop_takes_the_ramp_of_the_move() -> None:
    train = long_move()
    at = moment(train, 70_000)
    train.decelerate_to_stop(at)
    assert train.emitted(at + 60) == 70_000 + 17_778
    assert end_of(train) - at == pytest.approx(ramp_time_s(DOWN, 50_000, 50), rel=2e-3)
    assert train.speed(nextafter(end_of(train), 0)) == pytest.approx(50, rel=1e-3)


def test_a_decelerating_stop_takes_the_parameters_set_for_stops() -> None:
    train = long_move()
    train.decelerate_to_stop(moment(train, 70_000), HARD)
    assert train.emitted(START + 600) == 70_000 + ramp_pulses(HARD, 50_000, 500)


def test_an_endless_move_ends_by_a_stop() -> None:
    train = PulseTrain(plan(None, UP, DOWN), 1, START)
    assert train.ends_at is None
    at = moment(train, 1_000_000)
    train.decelerate_to_stop(at)
    assert train.emitted(end_of(train)) == 1_000_000 + 17_778


def test_a_stop_of_a_slow_move_is_immediate() -> None:
    train = PulseTrain(steady(None, 50, DOWN, DOWN), 1, START)
    train.decelerate_to_stop(START + 1)
    assert train.ends_at == START + 1


def test_a_stop_too_soft_for_what_is_left_ends_on_the_target() -> None:
    train = long_move()
    train.decelerate_to_stop(moment(train, 150_000), SOFT)
    assert train.emitted(START + 3600) == 200_000


def test_a_stop_during_the_last_deceleration_never_ends_it_later() -> None:
    train = long_move()
    end, at = end_of(train), moment(train, 190_000)
    train.decelerate_to_stop(at)
    assert train.ends_at == end
    train.decelerate_to_stop(at, HARD)
    assert end_of(train) < end
    assert 190_000 < train.emitted(end) < 200_000


def test_a_stopping_move_takes_no_new_speed() -> None:
    train = long_move()
    at = moment(train, 70_000)
    train.decelerate_to_stop(at)
    end = train.ends_at
    train.change_speed(at + 0.1, 60_000)
    train.accelerate(at + 0.2)
    assert train.ends_at == end


def test_a_new_speed_is_reached_over_an_s_curve() -> None:
    train = PulseTrain(plan(None, UP, DOWN), 1, START)
    at = moment(train, 100_000)
    train.change_speed(at, 20_000)
    reached = 100_000 + ramp_pulses(DOWN, 50_000, 20_000)
    assert train.speed(at) == pytest.approx(50_000)
    assert 20_000 < train.speed((at + moment(train, reached)) / 2) < 50_000
    assert train.speed(moment(train, reached)) == pytest.approx(20_000)
    train.accelerate(at + 5)
    assert train.speed(at + 10) == 50_000
    train.decelerate(at + 15)
    assert train.speed(at + 20) == 50


def test_neither_accelerate_nor_decelerate_goes_the_other_way() -> None:
    fast = PulseTrain(plan(None, UP, DOWN), 1, START)
    fast.change_speed(START + 2, 80_000)
    fast.accelerate(START + 10)
    assert fast.speed(START + 20) == 80_000
    slow = PulseTrain(steady(None, 20, UP, DOWN), 1, START)
    slow.decelerate(START + 1)
    assert slow.speed(START + 20) == 20


def test_a_move_sped_up_beyond_its_deceleration_ends_above_ol() -> None:
    train = long_move()
    train.change_speed(moment(train, 60_000), 80_000)
    assert train.speed(nextafter(end_of(train), 0)) > 1_000
    assert train.emitted(end_of(train)) == 200_000


def test_a_move_slowed_down_runs_on_at_ol_to_its_target() -> None:
    train = long_move()
    train.change_speed(moment(train, 60_000), 20_000)
    assert train.speed(nextafter(end_of(train), 0)) == 50
    assert train.emitted(end_of(train)) == 200_000


def test_a_move_never_speeds_up_to_reach_ol_at_its_deceleration() -> None:
    train = long_move()
    train.change_speed(moment(train, 60_000), 10)
    assert train.speed(moment(train, 199_999)) == 10


def test_the_last_deceleration_is_not_disturbed() -> None:
    train = long_move()
    end, at = train.ends_at, moment(train, 190_000)
    train.change_speed(at, 80_000)
    train.accelerate(at)
    train.decelerate(at)
    assert train.ends_at == end


def test_an_ended_move_ignores_every_command() -> None:
    train = long_move()
    end = end_of(train)
    train.decelerate_to_stop(end)
    train.change_speed(end, 1_000)
    assert (train.ends_at, train.emitted(end + 1)) == (end, 200_000)


def test_pulses_beyond_the_end_never_come() -> None:
    train = long_move()
    assert train.time_when(200_001) is None
    assert train.time_when(200_000) == train.ends_at


def test_pulses_from_before_a_bend_are_answered_with_the_bend() -> None:
    train = long_move()
    at = moment(train, 70_000)
    train.change_speed(at, 20_000)
    assert train.time_when(70_000) == at
    assert train.time_when(1) == at


@given(
    st.floats(0, 1e6),
    st.integers(1, 200_000),
    st.floats(0, 4),
    st.sampled_from(["run", "change", "brake", "accelerate", "decelerate"]),
    st.integers(1, 1_000_000),
)
def test_each_pulse_has_its_moment(start: float, pulse: int, after: float, deed: str, speed: int) -> None:
    train = PulseTrain(plan(200_000, UP, DOWN), 1, start)
    bend = start + after
    if deed == "change":
        train.change_speed(bend, speed)
    elif deed == "brake":
        train.decelerate_to_stop(bend)
    elif deed == "accelerate":
        train.accelerate(bend)
    elif deed == "decelerate":
        train.decelerate(bend)
    at = train.time_when(pulse)
    if at is None:
        assert train.emitted(end_of(train)) < pulse
    elif deed == "run" or pulse > train.emitted(bend):
        assert train.emitted(at) == pulse
        assert train.emitted(nextafter(at, 0)) == pulse - 1


@given(st.floats(0, 1e6), st.sampled_from([25_236, 182_222, 200_000, 1]))
def test_each_corner_of_the_curve_has_its_moment(start: float, pulse: int) -> None:
    train = PulseTrain(plan(200_000, UP, DOWN), 1, start)
    at = moment(train, pulse)
    around = [at]
    for _ in range(20):
        around = [nextafter(around[0], 0), *around, nextafter(around[-1], 1e9)]
    counts = [train.emitted(now) for now in around if now >= start]
    assert counts == sorted(counts)
    assert train.emitted(at) == pulse
