"""A unit: what its axes are, and why it does not tell where they stand."""

import pytest

from gateway.core.errors import InvalidRequest
from gateway.fics.units import RobotUnit
from protocols.fics.homing import HomeRobot
from protocols.fics.macros import RunMacro
from protocols.fics.notation import AxisSystem
from protocols.fics.status import MotionMode
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time


async def reasons(rig: FicsRig, unit: int = 1) -> dict[str, str]:
    it = rig.robot.unit(unit)
    return dict(await it.why_unknown(await it.position()))


@in_virtual_time
async def test_a_converted_axis_stands_for_the_motors_that_are_no_user_axes() -> None:
    async with fics_rig(units=2) as rig:
        scara, gantry = rig.robot.units
        assert [scara.motors_behind(axis) for axis in "XYZ"] == [["A", "B"], ["A", "B"], ["Z"]]
        assert [gantry.motors_behind(axis) for axis in "XYZ"] == [["X"], ["Y"], ["Z"]]


@in_virtual_time
async def test_h11_positions_that_are_not_told_have_a_reason() -> None:
    async with fics_rig(units=2) as rig:
        assert await reasons(rig) == dict.fromkeys("XYZ", "not_homed")
        homing = await rig.plant.robot_moves.start(rig.robot, 1, HomeRobot())
        assert await reasons(rig) == dict.fromkeys("XYZ", "homing")
        await rig.plant.robot_moves.wait(homing.id, 60)
        assert await reasons(rig) == {}
        macro = await rig.plant.robot_moves.start(
            rig.robot, 1, RunMacro(macro="PCK", arguments=[150.0, 140.0, -5.0])
        )
        assert await reasons(rig) == dict.fromkeys("XYZ", "macro")
        await rig.plant.robot_moves.wait(macro.id, 60)
        rig.touch(lambda fics, _: setattr(fics, "terminal", MotionMode.MACRO))
        assert await reasons(rig) == dict.fromkeys("XYZ", "automatic")
        rig.touch(lambda fics, _: setattr(fics, "terminal", None))
        assert await reasons(rig) == {}


@in_virtual_time
async def test_h11_each_axis_has_its_own_reason() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        rig.fics.units[1].motors[1].homed = False
        assert await reasons(rig) == {"X": "not_homed", "Y": "not_homed"}
        rig.fics.units[1].motors[1].homed = True
        rig.fics.units[1].motors[2].silent = True
        assert await reasons(rig) == {"Z": "not_known"}


@in_virtual_time
async def test_coordinates_the_axes_cannot_have_are_refused() -> None:
    async with fics_rig() as rig:
        systems = {"X": AxisSystem.PULSE, "@": AxisSystem.DEGREE}
        unit = RobotUnit(rig.robot, 3, ["X", "@"], ["X", "@"], systems)
        unit.require_values("user", [5.0, 0.5])
        with pytest.raises(InvalidRequest, match="Axis X: pulses are whole"):
            unit.require_values("user", [0.5, 0.5])
        with pytest.raises(InvalidRequest, match="has the axes X, @, and 3 coordinates"):
            unit.require_values("motor", [1.0, 1.0, 1.0])


@in_virtual_time
async def test_an_axis_that_user_and_motor_share_is_named_once() -> None:
    async with fics_rig() as rig:
        unit = rig.robot.unit(1)
        for axis in "XYZAB":
            unit.require_axis(axis)
        with pytest.raises(InvalidRequest, match="axis: r1/units/1 has the axes X, Y, Z, A, B;"):
            unit.require_axis("W")
