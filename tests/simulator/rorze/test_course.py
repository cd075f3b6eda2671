"""An axis under way on an interpolated path."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.rorze.path import Knot
from protocols.rorze.profile import SpeedParameters, plan, ramp_pulses
from simulator.rorze.course import Course, PathTrain, Stretch, Track

SPEED = SpeedParameters(low=100, high=10_000, acceleration=50_000, rising=50, falling=50)
START = 1_234.5

THERE_AND_BACK = Track([Knot(0, 0), Knot(3_000, 600.0), Knot(4_000, 100.4), Knot(5_000, 300)])
"""600 pulses CW, 500 CCW, 200 CW."""


def course(track: Track = THERE_AND_BACK) -> Course:
    return Course(track, plan(track.length, SPEED, SPEED).starting_at(START))


def test_pulses_are_even_between_the_knots() -> None:
    counts = {0: 0, 2: 0, 3: 1, 1_500: 300, 3_000: 600, 3_500: 350, 5_000: 300, 9_000: 300}
    assert {along: THERE_AND_BACK.count(along) for along in counts} == counts


def test_an_axis_turns_one_way_after_another() -> None:
    assert THERE_AND_BACK.stretches == (
        Stretch(0, 3_000, 1),
        Stretch(3_000, 4_000, -1),
        Stretch(4_000, 5_000, 1),
    )


def test_less_than_half_a_pulse_is_no_turning() -> None:
    trembling = Track([Knot(0, 0), Knot(10, 5), Knot(20, 4.6), Knot(30, 9), Knot(40, 8.9)])
    assert trembling.stretches == (Stretch(0, 40, 1),)
    assert Track([Knot(0, 0), Knot(10, 0.4), Knot(20, -0.4)]).stretches == ()


def test_a_path_is_stretched_to_whole_micrometres() -> None:
    track = Track([Knot(0, 0), Knot(0.5, 10), Knot(9.2, 20)])
    assert (track.length, track.count(10), track.count(5 / 9.2)) == (10, 20, 10)
    assert Track([Knot(0, 0), Knot(10 + 1e-9, 20)]).length == 10


def test_the_trains_of_a_course_follow_one_another_at_its_speed() -> None:
    way = course()
    trains = [PathTrain(way, stretch) for stretch in way.track.stretches]
    assert [train.displacement(train.ends_at) for train in trains] == [600, -500, 200]
    assert [train.final for train in trains] == [False, False, True]
    assert trains[-1].ends_at == way.profile.end_s
    for before, after in pairwise(trains):
        assert before.ends_at < after.ends_at
        assert before.emitted(before.ends_at + 1) == before.emitted(before.ends_at)
        assert after.emitted(before.ends_at) == 0


@given(st.integers(0, 2), st.integers(1, 700))
def test_the_moment_of_a_pulse_is_the_first_at_which_it_is_out(number: int, pulses: int) -> None:
    way = course()
    train = PathTrain(way, way.track.stretches[number])
    at = train.time_when(pulses)
    if at is None:
        assert train.emitted(train.ends_at) < pulses
        return
    assert train.emitted(at) >= pulses > train.emitted(at - 1e-6)
    assert train.running(at) or at == train.ends_at


def test_a_stop_on_one_stretch_ends_the_course_on_another() -> None:
    """The ramp of about 2 mm begins before the axis turns, and ends after it has turned once more."""
    way = course()
    first = PathTrain(way, way.track.stretches[0])
    at = first.time_when(590)
    assert at is not None
    first.decelerate_to_stop(at)
    trains = [first, *(PathTrain(way, stretch) for stretch in way.track.stretches[1:])]
    assert [train.final for train in trains] == [False, False, True]
    distance = way.profile.distance
    assert distance == pytest.approx(2_950 + ramp_pulses(SPEED, 10_000, 100), abs=5)
    assert sum(train.displacement(train.ends_at) for train in trains) == way.track.count(distance or 0)
    assert trains[-1].ends_at == way.profile.end_s


@given(st.floats(0.0, 4.0), st.floats(0.0, 2.0))
def test_a_stop_takes_no_pulse_back(stop_s: float, later_s: float) -> None:
    way = course(Track([Knot(0, 0), Knot(3_000, 30_000), Knot(10_000, 30_500)]))
    train = PathTrain(way, way.track.stretches[0])
    before = train.emitted(START + stop_s)
    train.decelerate_to_stop(START + stop_s)
    assert train.emitted(START + stop_s) == before
    assert train.emitted(START + stop_s + later_s) >= before


@given(st.lists(st.tuples(st.integers(1, 500), st.floats(-400, 400)), min_size=1, max_size=6))
def test_every_pulse_is_given_however_the_axis_turns(steps: list[tuple[int, float]]) -> None:
    knots = [Knot(0, 0)]
    for length, pulses in steps:
        knots.append(Knot(knots[-1].along + length, pulses))
    way = course(Track(knots))
    stretches = way.track.stretches
    assert all(before.direction == -after.direction for before, after in pairwise(stretches))
    trains = [PathTrain(way, stretch) for stretch in stretches]
    assert sum(train.displacement(train.ends_at) for train in trains) == way.track.pulses
