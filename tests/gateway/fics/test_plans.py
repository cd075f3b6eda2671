"""Plans of moves by the robot's own settings: they agree with the move, or there is none."""

import asyncio
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.errors import ControllerRefused
from gateway.fics.plans import PlannedRobotMove, plan_of, ride_over
from protocols.fics.homing import HomeRobot
from protocols.fics.jog import StepAxis
from protocols.fics.macros import RunMacro
from protocols.fics.motor_axes import MoveMotorsAbsolute, MoveMotorsRelative, SetMotorSpeedPercent
from protocols.fics.moves import MoveAbsolute, MoveRelative, MoveToPosition
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import (
    SetAccelerationTimes,
    SetMaximumSpeeds,
    SetSelfStartSpeeds,
    SetSmoothAcceleration,
    SetSpeedPercent,
)
from tests.fics_plants import FicsRig, fics_rig
from tests.virtual_time import run_virtual

CARTESIAN, SCARA = 2, 1


async def plan(rig: FicsRig, command: FicsCommand[Any], unit: int = CARTESIAN) -> PlannedRobotMove:
    before = rig.machine.truth.of("motion_start")
    planned = await plan_of(rig.robot.unit(unit), command)
    assert rig.machine.truth.of("motion_start") == before
    return planned


@pytest.mark.parametrize(
    ("settings", "command"),
    [
        ([], MoveAbsolute(coordinates=[100])),
        ([], MoveRelative(coordinates=[None, -3])),
        ([], MoveMotorsRelative(coordinates=[None, None, 7.5])),
        ([], MoveMotorsAbsolute(coordinates=[-20, 0, 0])),
        ([SetSpeedPercent(percents=[10])], MoveAbsolute(coordinates=[100])),
        ([SetMotorSpeedPercent(percents=[25.5])], MoveMotorsAbsolute(coordinates=[100])),
        (
            [SetMaximumSpeeds(speeds=[33]), SetAccelerationTimes(times_ms=[900])],
            MoveAbsolute(coordinates=[50]),
        ),
    ],
)
def test_the_move_of_one_axis_takes_as_long_as_planned(
    settings: list[FicsCommand[Any]], command: FicsCommand[Any]
) -> None:
    async def story() -> None:
        async with fics_rig(units=2) as rig:
            await rig.move(HomeRobot(), CARTESIAN)
            for setting in settings:
                await rig.robot.ask(setting, CARTESIAN)
            planned = await plan(rig, command)
            moved = await rig.move(command, CARTESIAN)
            start, stop = (rig.machine.truth.of(kind)[-1].at for kind in ("motion_start", "motion_stop"))
            assert planned.duration_s == pytest.approx(stop - start, abs=0.002)
            assert planned.note is None
            assert (planned.frame, planned.target_position) == (moved.frame, moved.target_position)
            assert planned.start_position == moved.start_position

    run_virtual(story())


@pytest.mark.parametrize(
    ("unit", "setting", "command", "says"),
    [
        (CARTESIAN, None, MoveAbsolute(coordinates=[10, 20]), "several axes together"),
        (SCARA, None, MoveAbsolute(coordinates=[100]), "Axis X is moved by several motors"),
        (CARTESIAN, SetSmoothAcceleration(enabled=1), MoveAbsolute(coordinates=[10]), "S-curves are on"),
        (CARTESIAN, SetSelfStartSpeeds(speeds_pps=[100]), MoveAbsolute(coordinates=[10]), "start speed"),
    ],
)
def test_a_duration_the_manual_does_not_tell_is_null_and_the_target_is_not(
    unit: int, setting: FicsCommand[Any] | None, command: FicsCommand[Any], says: str
) -> None:
    async def story() -> None:
        async with fics_rig(units=2) as rig:
            await rig.move(HomeRobot(), unit)
            if setting is not None:
                await rig.robot.ask(setting, unit)
            planned = await plan(rig, command, unit)
            assert planned.duration_s is None
            assert planned.target_position is not None
            assert says in (planned.note or "")

    run_virtual(story())


@pytest.mark.parametrize("command", [HomeRobot(), StepAxis(axis="X", steps=5), RunMacro(macro="PCK")])
def test_where_only_the_motion_itself_tells_the_end_it_is_null(command: FicsCommand[Any]) -> None:
    async def story() -> None:
        async with fics_rig(units=2) as rig:
            await rig.move(HomeRobot(), CARTESIAN)
            planned = await plan(rig, command)
            assert (planned.target_position, planned.duration_s) == (None, None)
            assert "only known when it is done" in (planned.note or "")
            assert planned.start_position == {"X": 0.0, "Y": 0.0, "Z": 0.0}

    run_virtual(story())


def test_a_stored_position_is_looked_up() -> None:
    async def story() -> None:
        async with fics_rig(units=2) as rig:
            await rig.move(HomeRobot(), CARTESIAN)
            await rig.robot.upload_positions([(7, [30.0, None, None])], CARTESIAN)
            planned = await plan(rig, MoveToPosition(position=7))
            assert (planned.frame, planned.target_position) == ("POM 7\\r", {"X": 30.0})
            assert planned.duration_s is not None
            missing = await plan(rig, MoveToPosition(position=8))
            assert missing.note == "It would be refused: position 8 is not set."

    run_virtual(story())


@pytest.mark.parametrize(
    ("unit", "command", "says"),
    [
        (CARTESIAN, MoveAbsolute(coordinates=[300.5]), "the target 300.5 mm of axis X lies beyond its upper"),
        (CARTESIAN, MoveRelative(coordinates=[None, -301]), "-301 mm of axis Y lies beyond its lower"),
        (CARTESIAN, MoveMotorsAbsolute(coordinates=[None, None, 101]), "101 mm of axis Z lies beyond"),
        (CARTESIAN, MoveMotorsRelative(coordinates=[-301]), "-301 mm of axis X lies beyond its lower"),
        (CARTESIAN, MoveToPosition(position=7), "the target 400 mm of axis X lies beyond its upper"),
        (SCARA, MoveAbsolute(coordinates=[301, -301]), "beyond its upper soft limit 300 mm, and the target"),
        (SCARA, MoveMotorsAbsolute(coordinates=[121]), "the target 121 degree of axis A lies beyond its up"),
    ],
)
def test_a_plan_names_the_soft_limit_that_the_move_is_then_refused_by(
    unit: int, command: FicsCommand[Any], says: str
) -> None:
    async def story() -> None:
        async with fics_rig(units=2) as rig:
            await rig.move(HomeRobot(), unit)
            await rig.robot.upload_positions([(7, [400.0, None, None])], unit)
            planned = await plan(rig, command, unit)
            assert (planned.note or "").startswith("It would be refused: the target")
            assert says in (planned.note or "")
            assert planned.target_position is not None
            assert planned.duration_s is None
            with pytest.raises(ControllerRefused) as refused:
                await rig.start(command, unit)
            assert says in refused.value.detail

    run_virtual(story())


def test_a_step_beyond_a_soft_limit_is_told_by_its_plan_and_by_its_refusal() -> None:
    async def story() -> None:
        async with fics_rig(units=2) as rig:
            await rig.move(HomeRobot(), CARTESIAN)
            await rig.move(MoveAbsolute(coordinates=[None, None, 99.5]), CARTESIAN)
            assert "limit" not in ((await plan(rig, StepAxis(axis="Z", steps=50))).note or "")
            step = StepAxis(axis="Z", steps=51)
            says = "the target 100.01 mm of axis Z lies beyond its upper soft limit 100 mm"
            assert (await plan(rig, step)).note == f"It would be refused: {says}."
            with pytest.raises(ControllerRefused) as refused:
                await rig.start(step, CARTESIAN)
            assert says in refused.value.detail

    run_virtual(story())


def test_a_plan_of_converted_axes_says_that_the_limits_of_their_motors_are_the_robots_to_check() -> None:
    async def story() -> None:
        async with fics_rig(units=2) as rig:
            await rig.move(HomeRobot(), SCARA)
            planned = await plan(rig, MoveAbsolute(coordinates=[100]), SCARA)
            assert "Only the robot knows whether the soft limits of its motors A and B" in (
                planned.note or ""
            )
            alone = await plan(rig, MoveAbsolute(coordinates=[None, None, 10]), SCARA)
            assert alone.note is None

    run_virtual(story())


def test_a_robot_that_is_not_homed_plans_relative_moves_and_says_no_to_others() -> None:
    async def story() -> None:
        async with fics_rig(units=2) as rig:
            relative = await plan(rig, MoveRelative(coordinates=[100]))
            assert relative.target_position == {"X": None}
            assert relative.duration_s == pytest.approx(0.4)
            absolute = await plan(rig, MoveAbsolute(coordinates=[100]))
            assert absolute.duration_s is None
            assert "It would be refused: The position of axis X" in (absolute.note or "")

    run_virtual(story())


def test_a_move_of_no_length_takes_no_time() -> None:
    async def story() -> None:
        async with fics_rig(units=2) as rig:
            await rig.move(HomeRobot(), CARTESIAN)
            assert (await plan(rig, MoveAbsolute(coordinates=[0]))).duration_s == 0.0

    run_virtual(story())


def test_while_the_robot_moves_or_is_away_the_frame_is_still_exact() -> None:
    async def story() -> None:
        async with fics_rig(units=2) as rig:
            await rig.move(HomeRobot(), CARTESIAN)
            await rig.start(HomeRobot(), CARTESIAN)
            busy = await plan(rig, MoveAbsolute(coordinates=[5]))
            assert (busy.frame, busy.duration_s) == ("LMA 5\\r", None)
            assert busy.note
            rig.cable.unplug()
            await asyncio.sleep(0.1)
            away = await plan(rig, MoveAbsolute(coordinates=[5]))
            assert (away.frame, away.start_position) == ("LMA 5\\r", None)
            assert "down" in (away.note or "")

    run_virtual(story())


@given(
    way=st.floats(0.1, 1000),
    start=st.floats(0, 50),
    more=st.floats(0, 200),
    share=st.floats(0.01, 1),
    times_s=st.tuples(st.floats(0, 5), st.floats(0, 5)),
)
def test_a_ride_goes_on_to_its_end_without_a_leap(
    way: float, start: float, more: float, share: float, times_s: tuple[float, float]
) -> None:
    top = start + more + 1
    ride = ride_over(way, start, top, share, *times_s)
    moments = [ride.duration_s * tick / 50 for tick in range(-1, 52)]
    places = [ride.gone(moment) for moment in moments]
    assert (places[0], places[-1]) == (0.0, way)
    for before, after in pairwise(places):
        assert -1e-6 <= after - before <= top * ride.duration_s / 50 + 1e-6
