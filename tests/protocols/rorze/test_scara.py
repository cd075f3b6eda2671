"""Where a SCARA robot's finger ends, and where its axes are for that."""

from math import pi

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from protocols.rorze.scara import (
    BeltLinked,
    FingerPlace,
    Mechanics,
    OutOfReach,
    Pose,
    ThreeAxes,
    within_half_turn,
)

ROBOT = ThreeAxes(215_000, 330_000, (121_791.045, 60_000.0, 100_000.0))
"""The robot of RC-420 manual 13.10.7."""

BELTS = BeltLinked(156_000, 208_000, (98_765.0, 99_000.0))
"""The robot of RC-420 manual 13.10.11."""

FINE = ThreeAxes(215_000, 330_000, (9_999_999.99,) * 3)
COARSE_BELTS = BeltLinked(1_000, 2_001, (360.0, 360.0))

ANGLES = st.floats(-179.0, 179.0)
BENDS = st.floats(-89.0, 89.0)


def test_the_worked_example() -> None:
    assert ROBOT.whole_pulses(FingerPlace(0, 115_000, 90_000)) == (-10_149, -10_000, -16_666)
    assert ROBOT.place((-10_149, -10_000, -16_666)) == pytest.approx((12, 115_000, 89_998), abs=0.5)


def test_each_axis_turns_what_it_carries() -> None:
    robot = ThreeAxes(1_000, 300, (100.0,) * 3)
    assert robot.place((0, 0, 0)) == pytest.approx((300, 0, 0))
    assert robot.place((25, 0, 0)) == pytest.approx((0, 300, 90_000))
    assert robot.place((0, 50, 0)) == pytest.approx((2_000 - 300, 0, -180_000))
    assert robot.place((0, 0, 25)) == pytest.approx((0, -300, -90_000))


def test_belts_keep_the_finger_on_the_line_of_the_arm() -> None:
    assert COARSE_BELTS.place((0, 0)) == pytest.approx((2_001, 0, 0))
    assert COARSE_BELTS.place((90, 30)) == pytest.approx((0, 2_001 + 1_000, 90_000))
    assert COARSE_BELTS.place((180, -90)) == pytest.approx((-1, 0, 180_000))


@given(base=ANGLES, arm=st.floats(-179.0, -1e-3), wrist=ANGLES)
def test_there_and_back_within_a_pulse(base: float, arm: float, wrist: float) -> None:
    """All over the reach, with the elbow bent as in the worked example."""
    pulses = tuple(
        round(angle / 360 * turn)
        for angle, turn in zip((base, arm, wrist), FINE.pulses_per_turn, strict=True)
    )
    assert FINE.pulses(FINE.place(pulses)) == pytest.approx(pulses, abs=1)


@given(turn=ANGLES, arm=BENDS)
def test_there_and_back_within_a_pulse_with_belts(turn: float, arm: float) -> None:
    robot = BeltLinked(100_000, 208_000, (9_999_999.99,) * 2)
    pulses = tuple(round(angle / 360 * 9_999_999.99) for angle in (turn, arm))
    assert robot.pulses(robot.place(pulses)) == pytest.approx(pulses, abs=1)


@given(st.integers(-900_000, 900_000), st.integers(-900_000, 900_000), st.integers(-180_000, 180_000))
def test_every_place_is_reached_or_refused(x: int, y: int, direction: int) -> None:
    place = FingerPlace(x, y, direction)
    wrist = abs(FINE.guide(complex(x, y), direction / 180_000 * pi))
    assume(abs(wrist - 2 * FINE.link) > 1)
    if wrist > 2 * FINE.link:
        with pytest.raises(OutOfReach, match="The wrist comes 430000 um from the origin"):
            FINE.pulses(place)
        return
    found = FINE.place(FINE.pulses(place))
    assert found[:2] == pytest.approx((x, y), abs=1e-3)
    assert (found.direction - direction + 180_000) % 360_000 == pytest.approx(180_000, abs=1e-3)


@pytest.mark.parametrize(
    ("robot", "nearest", "farthest"), [(BELTS, 0, 520_000), (COARSE_BELTS, 1, 4_001), (ROBOT, None, 760_000)]
)
def test_the_reach_ends_where_the_links_are_stretched(
    robot: Mechanics, nearest: int | None, farthest: int
) -> None:
    robot.pulses(FingerPlace(0, farthest, 90_000))
    with pytest.raises(OutOfReach):
        robot.pulses(FingerPlace(0, farthest + 1, 90_000))
    if nearest:
        robot.pulses(FingerPlace(0, nearest, 90_000))
        with pytest.raises(OutOfReach):
            robot.pulses(FingerPlace(0, nearest - 1, 90_000))


def test_an_arm_that_has_turned_round_stands_as_before() -> None:
    before, after = ROBOT.pose((100, -10_000, 7)), ROBOT.pose((100, 50_000, 7))
    assert after.reach == pytest.approx(before.reach)
    assert within_half_turn(after.heading - before.heading) == pytest.approx(0)


def test_belts_do_not_turn_the_arm_beyond_its_longest_reach() -> None:
    assert BELTS.pose((0, 24_750)).reach == pytest.approx(2 * 156_000)
    with pytest.raises(OutOfReach, match="beyond its longest reach"):
        BELTS.pose((0, 24_751))


@given(reach=st.floats(-429_000, 429_000), heading=st.floats(-9, 9), finger=st.floats(-9, 9))
def test_a_pose_has_its_angles_and_angles_their_pose(reach: float, heading: float, finger: float) -> None:
    pose = Pose(reach, heading, finger)
    assert ROBOT.pose(ROBOT.counted(ROBOT.angles(pose))) == pytest.approx(pose, abs=1e-3)


@pytest.mark.parametrize(
    ("angle", "least"), [(0.0, 0.0), (pi, pi), (4.0, 4.0 - 2 * pi), (-4.0, 2 * pi - 4.0)]
)
def test_the_least_angle_is_at_most_half_a_turn(angle: float, least: float) -> None:
    assert within_half_turn(angle) == pytest.approx(least)
    assert abs(within_half_turn(angle, pi)) <= pi / 2
