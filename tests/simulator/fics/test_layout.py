"""The layouts of a simulated Fics."""

import pytest

from protocols.fics.notation import AxisSystem
from simulator.fics.geometry import Cartesian, MiniScara
from simulator.fics.layout import KITS, MEASURES, Layout
from tests.simulator.fics.bench import Bench


def test_the_first_unit_is_a_miniscara_and_the_others_are_cartesian() -> None:
    units = Layout(units=3, axes="XYZ@").build_units()
    assert [type(unit.geometry) for unit in units.values()] == [MiniScara, Cartesian, Cartesian]
    assert [[axis.name for axis in unit.users] for unit in units.values()] == [["X", "Y", "Z", "@"]] * 3
    assert [motor.name for motor in units[1].motors] == ["A", "B", "Z", "@"]
    assert [motor.name for motor in units[2].motors] == ["X", "Y", "Z", "@"]


@pytest.mark.parametrize("axes", ["Z", "YX", "XZY", "@W"])
def test_without_x_and_y_in_front_there_are_no_arms(axes: str) -> None:
    (unit,) = Layout(axes=axes).build_units().values()
    assert [motor.name for motor in unit.motors] == [axis.name for axis in unit.users] == list(axes)


def test_each_axis_counts_in_its_own_system() -> None:
    (unit,) = Layout(axes="XYZ@W").build_units().values()
    mm, pulse, degree = AxisSystem.MILLIMETRE, AxisSystem.PULSE, AxisSystem.DEGREE
    assert [axis.measure.system for axis in unit.users] == [mm, mm, mm, degree, pulse]
    assert [motor.measure.system for motor in unit.motors] == [degree, degree, mm, degree, pulse]


def test_the_settings_of_a_new_system_are_told() -> None:
    bench = Bench(Layout(axes="Z@W"))
    assert bench.ask("VSO") == ["VSO 300,60,50"]
    assert bench.ask("SLP") == ["SLP 100,180,90000"]
    assert bench.ask("HMV") == ["HMV 30,10,5"]
    assert bench.ask("HMB") == ["HMB 5,1,0.5"]


@pytest.mark.parametrize("name", KITS)
def test_sensors_stand_in_the_order_in_which_homing_meets_them(name: str) -> None:
    world = KITS[name].world
    assert world.minus_limit < world.dog[0] < world.dog[1] < 0 < world.plus_limit
    assert name in MEASURES or name in "AB"


@pytest.mark.parametrize(
    ("wrong", "complaint"),
    [
        ({"units": 0}, "there can be 1 to 9 units, not 0"),
        ({"units": 10}, "there can be 1 to 9 units, not 10"),
        ({"axes": ""}, "'' is no set of axes; take each of XYZ@W at most once"),
        ({"axes": "XX"}, "'XX' is no set of axes"),
        ({"axes": "XQ"}, "'XQ' is no set of axes"),
        ({"axes": "xyz"}, "'xyz' is no set of axes"),
    ],
)
def test_impossible_layouts_are_told_in_a_sentence(wrong: dict[str, object], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        Layout(**wrong)  # type: ignore[arg-type]  # wrong on purpose
