"""The axes of a unit, and the questions that each can answer."""

import pytest

from gateway.core.errors import InvalidRequest, NotFound
from gateway.fics.axes import UnitAxes, unit_of
from protocols.fics.jog import StepAxis
from protocols.fics.motor_axes import MoveMotorsAbsolute
from protocols.fics.moves import MoveAbsolute
from protocols.fics.notation import AxisSystem

SYSTEMS = {"X": AxisSystem.PULSE, "@": AxisSystem.DEGREE}
TABLE = UnitAxes("r1", 3, ["X", "@"], ["X", "@"], SYSTEMS)
SCARA = UnitAxes("r1", 1, ["X", "Y", "Z"], ["A", "B", "Z"], dict.fromkeys("XYZAB", AxisSystem.MILLIMETRE))


def test_a_converted_axis_stands_for_the_motors_that_are_no_user_axes() -> None:
    assert [SCARA.motors_behind(axis) for axis in "XYZ"] == [["A", "B"], ["A", "B"], ["Z"]]
    assert [TABLE.motors_behind(axis) for axis in "X@"] == [["X"], ["@"]]


def test_a_step_speaks_in_the_coordinates_of_its_axis() -> None:
    assert SCARA.coordinates_of(StepAxis(axis="X", steps=1)) == "user"
    assert SCARA.coordinates_of(StepAxis(axis="A", steps=1)) == "motor"
    assert SCARA.coordinates_of(MoveAbsolute(coordinates=[1.0])) == "user"
    assert SCARA.coordinates_of(MoveMotorsAbsolute(coordinates=[1.0])) == "motor"


def test_each_axis_has_its_own_unit() -> None:
    assert TABLE.counted_in("user") == {"X": "pulse", "@": "degree"}


def test_coordinates_the_axes_cannot_have_are_refused() -> None:
    TABLE.require_values("user", [5.0, 0.5])
    with pytest.raises(InvalidRequest, match="Axis X: pulses are whole"):
        TABLE.require_values("user", [0.5, 0.5])
    with pytest.raises(InvalidRequest, match="has the axes X, @, and 3 coordinates"):
        TABLE.require_values("motor", [1.0, 1.0, 1.0])


def test_an_axis_that_user_and_motor_share_is_named_once() -> None:
    for axis in "XYZAB":
        SCARA.require_axis(axis)
    with pytest.raises(InvalidRequest, match="axis: r1/units/1 has the axes X, Y, Z, A, B;"):
        SCARA.require_axis("W")


def test_a_unit_that_is_not_configured_is_named_with_those_that_are() -> None:
    assert unit_of([SCARA, TABLE], 3) is TABLE
    with pytest.raises(NotFound, match="Robot r1 has no unit 2, but 1, 3; nothing was sent"):
        unit_of([SCARA, TABLE], 2)
