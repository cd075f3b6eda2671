"""Numbers of axes: into the robot's order and back, in the units the axes are set up for."""

import pytest

from gateway.core.errors import InvalidRequest
from gateway.fics.amounts import Amount, AxisSpeed, build, in_order, numbers
from gateway.fics.axes import UnitAxes
from protocols.fics.moves import MoveAbsolute
from protocols.fics.notation import AxisSystem
from tests.api.robots.cell import Cell, in_cell


def pulses(cell: Cell) -> UnitAxes:
    """A unit that counts pulses and has a theta."""
    systems = {"X": AxisSystem.PULSE, "W": AxisSystem.PULSE, "@": AxisSystem.DEGREE}
    return UnitAxes("r1", 3, ["X", "W", "@"], ["X", "W", "@"], systems)


@in_cell()
async def test_each_axis_is_counted_in_its_own_system(cell: Cell) -> None:
    unit = pulses(cell)
    assert [unit.systems[axis].value for axis in "XW@"] == ["pulse", "pulse", "degree"]
    scara = cell.rig.robot.unit(1)
    assert [scara.systems[axis].value for axis in "XABZ"] == ["mm", "degree", "degree", "mm"]


@in_cell()
async def test_values_by_name_come_into_the_order_of_the_axes(cell: Cell) -> None:
    unit = pulses(cell)
    assert in_order("axes", unit, unit.axes, {"@": 5, "X": 1}) == [1, None, 5]
    given = {"W": Amount(value=7, unit="pulse"), "@": Amount(value=0.5, unit="degree")}
    assert numbers("axes", unit, unit.axes, given) == [None, 7, 0.5]
    assert unit.by_axis(unit.axes, [1, 2, 3]) == {"X": 1, "W": 2, "@": 3}


@in_cell()
async def test_a_fraction_of_a_pulse_is_refused_but_not_of_a_speed(cell: Cell) -> None:
    unit = pulses(cell)
    speed = {"W": AxisSpeed(value=1.5, unit="kpps")}
    assert numbers("maximum_speed", unit, unit.axes, speed) == [None, 1.5, None]
    with pytest.raises(InvalidRequest, match=r"axes\.W\.value: pulses are whole, 1.5 is not"):
        numbers("axes", unit, unit.axes, {"W": Amount(value=1.5, unit="pulse")})


@in_cell()
async def test_another_number_of_axes_than_configured_is_told(cell: Cell) -> None:
    unit = pulses(cell)
    with pytest.raises(InvalidRequest, match="has 2 axes, 3 are configured"):
        unit.by_axis(unit.axes, [1, 2])


def test_what_cannot_be_written_is_refused_with_its_field() -> None:
    with pytest.raises(InvalidRequest, match="axes: at least one axis needs a value; nothing was sent"):
        build("axes", MoveAbsolute, coordinates=[None])
