"""The motors of a unit without the unit: a course moves them all the same."""

import pytest

from simulator.fics.acts.moves import single
from simulator.fics.axes import DEGREE, MILLIMETRE, Motor, World
from simulator.fics.course import Course, Span, stroke
from simulator.fics.geometry import Cartesian, MiniScara
from simulator.fics.mechanics import Mechanics
from simulator.fics.motion import Ramps

WORLD = World(dog=(-25.0, -20.0), minus_limit=-360.0, plus_limit=340.0, z_period=5.0)
RAMPS = Ramps(0.0, 10.0)


def motor(name: str) -> Motor:
    measure = MILLIMETRE if name == "Z" else DEGREE
    return Motor(name, measure, 500.0, 300.0, -300.0, world=WORLD)


def test_motors_stand_where_they_were_put() -> None:
    mechanics = Mechanics(1, Cartesian(), [motor("Z"), motor("@")])
    assert mechanics.at_rest() == (0.0, 0.0)
    mechanics.put((3.0, -4.5))
    assert mechanics.at_rest() == (3.0, -4.5)
    assert [motor.at for motor in mechanics.motors] == [3.0, -4.5]


def test_a_course_leaves_them_where_it_ends_and_tells_their_unit() -> None:
    mechanics = Mechanics(7, Cartesian(), [motor("Z"), motor("@")])
    course = Course(mechanics)
    course.start(single(stroke({1: Span(0.0, 20.0)}, {1: RAMPS}, 0.0)))
    assert course.motor_places(1.0) == (0.0, 10.0)
    course.advance(2.0)
    assert course.ended
    assert mechanics.at_rest() == (0.0, 20.0)
    told = [(fact.kind, fact.body, fact.facts["axis"]) for fact in mechanics.truth]
    assert told == [("axis_start", 7, "@"), ("axis_stop", 7, "@")]


def test_a_converted_course_puts_both_arms() -> None:
    mechanics = Mechanics(1, MiniScara(), [motor("A"), motor("B")])
    course = Course(mechanics, converted=True)
    course.start(single(stroke({0: Span(150.0, 140.0)}, {0: RAMPS}, 0.0)))
    course.advance(1.0)
    assert mechanics.geometry.to_user(mechanics.at_rest()) == pytest.approx((140.0, 150.0))
