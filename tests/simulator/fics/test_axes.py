"""Settings of axes, the sensors in their world, and what a loss of power leaves."""

from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulator.fics.axes import DEGREE, MILLIMETRE, PULSE, Axis, Motor, Sensor, World
from simulator.fics.motion import Ramps

WORLD = World(dog=(-25.0, -20.0), minus_limit=-130.0, plus_limit=110.0, z_period=5.0)


def motor() -> Motor:
    return Motor("Z", MILLIMETRE, 300.0, 100.0, -100.0, world=WORLD, homing_speed=30.0, z_speed=5.0)


def test_each_axis_system_has_its_units() -> None:
    # mm/s, kpps and rpm (C-HOST manual 1-5).
    assert [measure.speed_factor for measure in (MILLIMETRE, PULSE, DEGREE)] == [1.0, 1000.0, 6.0]
    assert [measure.step for measure in (MILLIMETRE, PULSE, DEGREE)] == [0.01, 1.0, 0.01]


def test_a_slower_move_ramps_at_the_same_rate() -> None:
    axis = Axis("X", MILLIMETRE, 500.0, 300.0, -300.0, acceleration_ms=250, deceleration_ms=100)
    assert axis.ramps(100.0, s_curve=False) == Ramps(0.0, 500.0, 2000.0, 5000.0)
    assert axis.ramps(10.0, s_curve=True) == Ramps(0.0, 50.0, 2000.0, 5000.0, s_curve=True)


def test_the_times_are_those_between_start_speed_and_top_speed() -> None:
    axis = Axis("X", MILLIMETRE, 50.0, 300.0, -300.0, start_speed_pps=1000)
    assert axis.ramps(100.0, s_curve=False) == Ramps(10.0, 50.0, 200.0, 200.0)


def test_a_start_speed_as_high_as_the_top_speed_leaves_nothing_to_ramp() -> None:
    axis = Axis("X", MILLIMETRE, 5.0, 300.0, -300.0, start_speed_pps=9999)
    assert axis.ramps(50.0, s_curve=False) == Ramps(5.0, 2.5, inf, inf)


def test_homing_looks_for_its_sensors_at_its_own_speed() -> None:
    assert motor().search_ramps(5.0) == Ramps(0.0, 5.0, 1500.0, 1500.0)


def test_soft_limits_include_themselves() -> None:
    assert [motor().within_limits(place) for place in (-100.01, -100.0, 100.0, 100.01)] == [
        *(False, True, True, False)
    ]


@pytest.mark.parametrize(
    ("place", "seen"),
    [
        (0.0, set()),
        (-20.0, {Sensor.ORIGIN}),
        (-25.0, {Sensor.ORIGIN}),
        (-26.0, set()),
        (-130.0, {Sensor.MINUS_LIMIT}),
        (110.0, {Sensor.PLUS_LIMIT}),
    ],
)
def test_sensors_answer_where_they_stand(place: float, seen: set[Sensor]) -> None:
    assert {sensor for sensor in Sensor if motor().sees(sensor, place)} == seen


def test_a_sensor_can_be_held() -> None:
    axis = motor()
    assert (axis.limit(Sensor.PLUS_LIMIT), axis.limit(Sensor.MINUS_LIMIT)) == (110.0, -130.0)
    axis.held = {Sensor.PLUS_LIMIT: True, Sensor.MINUS_LIMIT: False}
    assert axis.sees(Sensor.PLUS_LIMIT, 0.0)
    assert not axis.sees(Sensor.MINUS_LIMIT, -200.0)
    axis.at = 7.0
    assert (axis.limit(Sensor.PLUS_LIMIT), axis.limit(Sensor.MINUS_LIMIT)) == (7.0, inf)


def test_the_sensors_stay_where_they_are_when_coordinates_do_not() -> None:
    axis = motor()
    axis.zero = -15.0
    assert axis.limit(Sensor.PLUS_LIMIT) == 125.0
    assert axis.sees(Sensor.ORIGIN, -5.0)


@given(st.floats(-1000, 1000), st.sampled_from([1.0, -1.0]))
def test_the_next_z_phase_is_ahead_and_at_most_a_period_away(place: float, direction: float) -> None:
    z = WORLD.next_z(place, direction)
    assert z % WORLD.z_period == 0
    assert 0 <= (z - place) * direction <= WORLD.z_period


def test_a_driver_moves_its_motor_unless_it_has_an_error_or_is_silent() -> None:
    axis = motor()
    assert axis.ready()
    axis.driver_error = 0xF0
    assert not axis.ready()
    axis.driver_error, axis.silent = 0, True
    assert not axis.ready()
    axis.homed = True
    assert not axis.known()


def test_without_power_it_stands_where_it_was_and_calls_that_zero() -> None:
    axis = motor()
    axis.at, axis.zero, axis.homed, axis.driver_error = 30.0, -15.0, True, 0xF0
    axis.lose_power()
    assert (axis.at, axis.zero, axis.homed, axis.driver_error) == (0.0, 15.0, False, 0)
