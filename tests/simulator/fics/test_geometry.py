"""From motors to the tool and back."""

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
def test_the_arms_are_only_so_long(place: tuple[float, float]) -> None:
    with pytest.raises(OutOfReach):
        MiniScara().to_motors(place)


def test_a_cartesian_unit_converts_nothing() -> None:
    assert Cartesian().to_user((1.0, 2.0)) == Cartesian().to_motors((1.0, 2.0)) == (1.0, 2.0)
