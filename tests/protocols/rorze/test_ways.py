"""The ways of a SCARA robot's moves, from the place of RC-420 manual 13.10.7."""

from cmath import rect
from math import floor, inf, pi

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocols.rorze.interpolation import PathPoint
from protocols.rorze.path import Corner, Path, PathFault, rounded
from protocols.rorze.scara import BeltLinked, FingerPlace, Mechanics, OutOfReach, Pose, ThreeAxes
from protocols.rorze.ways import Way, about, along, by, end_of, finger_turns, out, turns_towards

ROBOT = ThreeAxes(215_000, 330_000, (121_791.045, 60_000.0, 100_000.0))
BELTS = BeltLinked(156_000, 208_000, (98_765.0, 99_000.0))
START = (-10_149, -10_000, -16_666)
POINTS = {0: PathPoint(x=255_000, y=300_000, radius=120_000), 1: PathPoint(x=255_000, y=450_000, radius=0)}


def end_by(way: Way, start: tuple[int, ...] = START, robot: Mechanics = ROBOT) -> FingerPlace:
    turned = way(robot, robot.pose(start)).pulses()
    return robot.place([here + pulses for here, pulses in zip(start, turned, strict=True)])


@pytest.mark.parametrize(
    ("way", "end"),
    [
        (by(-50_000), (-50_000, 115_000, 90_000)),
        (by(100_000j), (0, 215_000, 90_000)),
        (out(50_000), (0, 165_000, 90_000)),
        (out(-100_000), (0, 15_000, 90_000)),
        (out(400_000), (0, 515_000, 90_000)),
        (along(POINTS), (255_000, 450_000, 90_000)),
        (about(150_000, 0), (180_000, -65_000, 0)),
        (about(330_000, 90_000), (0, 115_000, 90_000)),
    ],
)
def test_where_a_way_ends(way: Way, end: tuple[float, ...]) -> None:
    assert end_by(way)[:2] == pytest.approx(end[:2], abs=60)
    assert end_by(way).direction == pytest.approx(end[2], abs=6)


@settings(max_examples=25)
@given(st.builds(complex, st.integers(-300_000, 300_000), st.integers(-300_000, 300_000)))
def test_the_end_is_that_of_the_knots(distance: complex) -> None:
    path = by(distance)(ROBOT, ROBOT.pose(START))
    try:
        knots = [path.knots(axis)[-1].pulses for axis in range(3)]
    except OutOfReach:
        with pytest.raises(OutOfReach):
            path.pulses()
        return
    assert path.pulses() == tuple(floor(pulses + 0.5) for pulses in knots)


def test_a_path_out_of_reach_is_none_though_its_ends_are_reached() -> None:
    place = FingerPlace(0, 700_000, 90_000)
    start = ROBOT.whole_pulses(place)
    with pytest.raises(OutOfReach):
        end_by(along({0: PathPoint(x=0, y=900_000, radius=0), 1: PathPoint(x=0, y=700_000, radius=0)}), start)


def test_the_finger_turns_alone_where_it_has_an_axis() -> None:
    pose = ROBOT.pose(START)
    assert finger_turns(ROBOT, pose, 180_000) == {2: pytest.approx(-pi / 2, abs=1e-4)}
    with pytest.raises(PathFault, match="no axis of its own"):
        finger_turns(BELTS, BELTS.pose((0, 0)), 90_000)
    with pytest.raises(PathFault, match="no axis of its own"):
        about(0, 90_000)(BELTS, BELTS.pose((0, 0)))


def test_base_and_finger_turn_a_quarter_at_most_and_belts_as_far_as_need_be() -> None:
    turns = turns_towards(ROBOT, ROBOT.pose(START), -100_000 - 400_000j)
    assert max(map(abs, turns.values())) <= pi / 2
    assert turns_towards(BELTS, BELTS.pose((0, 0)), -200_000 + 1j)[0] == pytest.approx(pi, abs=1e-4)


def test_a_target_has_to_give_a_direction_within_reach() -> None:
    for target in (None, 0j):
        with pytest.raises(PathFault, match="no direction"):
            turns_towards(ROBOT, ROBOT.pose(START), target)
    with pytest.raises(OutOfReach):
        turns_towards(ROBOT, ROBOT.pose(START), 800_000)


def test_a_path_with_a_missing_point_has_no_end() -> None:
    assert end_of(POINTS) == 255_000 + 450_000j
    assert end_of({}) is None
    assert end_of({0: PathPoint(place="center")}) is None
    with pytest.raises(PathFault, match="missing"):
        end_of({1: POINTS[1]})


@pytest.mark.parametrize("beside_um", [1.0, 500.0, 40_000.0])
def test_beside_the_origin_the_heading_turns_as_fast_as_it_is_near(beside_um: float) -> None:
    pose = Pose(200_000, 0.0, 0.0)
    aside = by(1j * beside_um)(ROBOT, pose)
    assert aside.sharpest_turn() == pytest.approx(1 / 200_000, rel=1e-3)
    past = Path(
        ROBOT, pose, rounded(200_000, [Corner(200_000 + 1j * beside_um), Corner(-200_000 + 1j * beside_um)])
    )
    assert past.sharpest_turn() == pytest.approx(1 / beside_um, rel=1e-3)


def test_straight_through_the_origin_nothing_turns() -> None:
    assert out(400_000)(ROBOT, ROBOT.pose(START)).sharpest_turn() == pytest.approx(0, abs=1e-12)
    centred = {0: PathPoint(place="center"), 1: PathPoint(x=0, y=600_000, radius=0)}
    assert along(centred)(ROBOT, Pose(-215_000, pi / 2, pi / 2)).sharpest_turn() == pytest.approx(0, abs=1e-9)


def test_from_the_origin_the_heading_jumps_where_the_way_leads_aside() -> None:
    folded = ROBOT.pose((0, 0, 0))
    assert folded.reach == 0
    assert by(100_000 * rect(1, folded.heading))(ROBOT, folded).sharpest_turn() == pytest.approx(0, abs=1e-9)
    assert by(100_000 * rect(1, folded.heading + 0.5))(ROBOT, folded).sharpest_turn() == inf
