"""The axes of a unit, and the moves that its arms can make."""

import pytest

from simulator.fics.course import Span
from simulator.fics.geometry import OutOfReach
from simulator.fics.layout import Layout
from simulator.fics.units import BeyondLimits, Unit


def unit(axes: str = "XYZ", *, homed: bool = True) -> Unit:
    made = Layout(axes=axes).build_units()[1]
    for motor in made.motors:
        motor.homed = homed
    return made


def test_the_user_axes_of_a_miniscara_are_converted_and_the_others_are_the_motors_themselves() -> None:
    scara = unit()
    assert [axis.name for axis in scara.users] == ["X", "Y", "Z"]
    assert [motor.name for motor in scara.motors] == ["A", "B", "Z"]
    assert scara.users[2] is scara.motors[2]
    assert [motor.name for motor in scara.motors_of(0)] == ["A", "B"]
    assert [motor.name for motor in scara.motors_of(2)] == ["Z"]


def test_the_user_axes_of_a_cartesian_unit_are_its_motors() -> None:
    straight = unit("Z@W")
    assert straight.users == straight.motors
    assert not any(map(straight.is_converted, range(3)))


def test_a_user_axis_is_known_when_all_its_motors_are() -> None:
    scara = unit()
    assert scara.shown_users(0.0) == [150, 150, 0]
    scara.motors[0].homed = False
    assert scara.shown_motors(0.0) == [None, 0, 0]
    assert scara.shown_users(0.0) == [None, None, 0]


def test_places_are_shown_as_they_are_displayed() -> None:
    straight = unit("Z@W")
    straight.put((-0.001, 12.3456, 41.7))
    assert straight.shown_motors(0.0) == [0, 12.35, 42]
    assert str(straight.shown_motors(0.0)[0]) == "0.0"


def test_without_power_it_is_slow_no_longer_and_knows_nothing() -> None:
    scara = unit()
    for axis in (*scara.users, *scara.motors):
        axis.percent = 5.0
    scara.put((10.0, 0.0, 20.0))
    scara.lose_power()
    assert {axis.percent for axis in (*scara.users, *scara.motors)} == {100.0}
    assert scara.shown_motors(0.0) == [None, None, None]
    assert [motor.zero for motor in scara.motors] == [10.0, 0.0, 20.0]


def test_a_way_within_the_limits_is_free() -> None:
    spans = {0: Span(150.0, 140.0), 1: Span(150.0, 160.0)}
    unit().require_free_way(spans)
    assert unit().free_share(spans) == 1.0


def test_a_way_ends_where_a_motor_reaches_its_limit() -> None:
    scara = unit()
    spans = {0: Span(150.0, 260.0), 1: Span(150.0, 260.0)}
    with pytest.raises(BeyondLimits, match="B would go to -8"):
        scara.require_free_way(spans)
    share = scara.free_share(spans)
    end = 150.0 + 110.0 * share
    # B stands at its limit, or as good as there.
    assert scara.geometry.to_motors((end, end, 0.0))[1] == pytest.approx(-80.0, abs=0.01)


def test_a_way_ends_where_the_arms_do() -> None:
    scara = unit()
    scara.motors[1].minus_limit = -100.0
    spans = {0: Span(150.0, 260.0), 1: Span(150.0, 260.0)}
    with pytest.raises(OutOfReach):
        scara.require_free_way(spans)
    assert 150.0 + 110.0 * scara.free_share(spans) == pytest.approx(300 / 2**0.5)
