"""From motors to the tool and back."""

from math import cos, hypot, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulator.fics.geometry import Cartesian, MiniScara, OutOfReach


def test_at_zero_the_arms_stand_at_a_right_angle() -> None:
    assert MiniScara().to_user((0.0, 0.0, 7.0)) == pytest.approx((150.0, 150.0, 7.0))


def test_a_quarter_turn_of_the_arm_turns_the_tool() -> None:
    assert MiniScara().to_user((90.0, 0.0)) == pytest.approx((-150.0, 150.0))


@given(st.floats(-170, 170), st.floats(-80, 80), st.floats(-100, 100))
def test_the_conversion_has_an_inverse(arm: float, forearm: float, height: float) -> None:
    motors = (arm, forearm, height)
    assert MiniScara().to_motors(MiniScara().to_user(motors)) == pytest.approx(motors, abs=1e-6)


@pytest.mark.parametrize("place", [(300.1, 0.0), (0.0, -301.0), (1e6, 1e6)])
def test_the_arms_have_an_end(place: tuple[float, float]) -> None:
    with pytest.raises(OutOfReach):
        MiniScara().to_motors(place)


def test_a_cartesian_unit_converts_nothing() -> None:
    assert Cartesian().to_user((1.0, 2.0)) == Cartesian().to_motors((1.0, 2.0)) == (1.0, 2.0)


@pytest.mark.parametrize(
    "place", [(300.0, 0.0), (180.0, 240.0), (-300 * 0.5**0.5, 300 * 0.5**0.5), (0.0, 0.0)]
)
def test_the_edges_of_what_the_arms_reach_are_reached(place: tuple[float, float]) -> None:
    assert MiniScara().to_user(MiniScara().to_motors(place)) == pytest.approx(place, abs=1e-4)


@given(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9), st.lists(st.floats(-1e9, 1e9), max_size=3))
def test_any_place_is_converted_or_out_of_reach(x: float, y: float, others: list[float]) -> None:
    try:
        motors = MiniScara().to_motors((x, y, *others))
    except OutOfReach:
        assert hypot(x, y) > 300 - 1e-4
    else:
        assert hypot(x, y) < 300 + 1e-4
        assert MiniScara().to_user(motors) == pytest.approx((x, y, *others), abs=1e-4)
        assert -180 <= motors[0] <= 180
        assert -90 <= motors[1] <= 90


@given(st.floats(0, 300), st.floats(-pi, pi))
def test_every_place_within_the_arms_length_has_its_motors(radius: float, angle: float) -> None:
    place = radius * cos(angle), radius * sin(angle)
    assert MiniScara().to_user(MiniScara().to_motors(place)) == pytest.approx(place, abs=1e-4)
