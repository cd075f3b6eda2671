"""The paths of interpolated moves, and the axes' positions along them."""

from bisect import bisect_right
from cmath import phase, rect
from collections.abc import Sequence
from itertools import pairwise
from math import hypot, pi, sqrt

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from protocols.rorze.path import (
    TOLERANCE_PULSES,
    Arc,
    Corner,
    Knot,
    Path,
    PathFault,
    Segment,
    StraightLine,
    rounded,
)
from protocols.rorze.scara import BeltLinked, Mechanics, OutOfReach, Pose, ThreeAxes

ROBOT = ThreeAxes(215_000, 330_000, (121_791.045, 60_000.0, 100_000.0))
BELTS = BeltLinked(156_000, 208_000, (98_765.0, 99_000.0))

START = (-10_149, -10_000, -16_666)


def length(segments: Sequence[Segment]) -> float:
    return sum(segment.length for segment in segments)


# Corners


def test_a_rounded_corner_is_an_arc_between_two_tangents() -> None:
    into, arc, out = rounded(0j, [Corner(100 + 0j, 20), Corner(100 + 50j)])
    assert into.at(0) == 0j
    assert into.at(into.length) == pytest.approx(80)
    assert arc.at(arc.length / 2) == pytest.approx(80 + 20j + 20 * (sqrt(0.5) - sqrt(0.5) * 1j))
    assert out.at(0) == pytest.approx(100 + 20j)
    assert out.at(out.length) == 100 + 50j
    assert length([into, arc, out]) == pytest.approx(80 + 20 * pi / 2 + 30)


def test_a_corner_without_radius_stays_sharp() -> None:
    assert rounded(0j, [Corner(3 + 0j), Corner(3 + 4j)]) == [
        StraightLine(0j, 3 + 0j),
        StraightLine(3 + 0j, 3 + 4j),
    ]


def test_points_that_lie_on_each_other_are_one() -> None:
    assert rounded(0j, [Corner(0j), Corner(3 + 0j), Corner(3 + 0j)]) == [StraightLine(0j, 3 + 0j)]
    assert rounded(0j, [Corner(0j)]) == []


def test_corners_may_share_a_side_to_the_last_micrometre() -> None:
    path = rounded(0j, [Corner(10 + 0j, 10), Corner(10 + 20j, 10), Corner(20j)])
    assert [type(segment) for segment in path] == [Arc, Arc]
    assert path[-1].at(path[-1].length) == pytest.approx(20j)


@pytest.mark.parametrize(
    ("corners", "why"),
    [
        ([], "no points"),
        ([Corner(10 + 0j, 5)], "end of the path has a radius"),
        ([Corner(10 + 0j, 11), Corner(10 + 30j)], "need 11 um of a side of 10 um"),
        ([Corner(30 + 0j, 11), Corner(30 + 10j)], "need 11 um of a side of 10 um"),
        ([Corner(30 + 0j, 6), Corner(30 + 10j, 6), Corner(10j)], "need 12 um of a side of 10 um"),
        ([Corner(30 + 0j, 1), Corner(0j)], "of a side of 30 um"),
    ],
)
def test_what_does_not_fit_is_no_path(corners: list[Corner], why: str) -> None:
    with pytest.raises(PathFault, match=why):
        rounded(0j, corners)


PLACES = st.builds(complex, st.integers(-1_000, 1_000), st.integers(-1_000, 1_000))


@given(PLACES, st.lists(st.builds(Corner, PLACES, st.integers(0, 200)), max_size=4), PLACES)
def test_a_path_has_neither_gaps_nor_kinks_at_rounded_corners(
    start: complex, corners: list[Corner], end: complex
) -> None:
    try:
        segments = rounded(start, [*corners, Corner(end)])
    except PathFault:
        return
    assert not segments or segments[0].at(0) == pytest.approx(start, abs=1e-6)
    assert not segments or segments[-1].at(segments[-1].length) == pytest.approx(end, abs=1e-5)
    for before, after in pairwise(segments):
        assert before.at(before.length) == pytest.approx(after.at(0), abs=1e-5)
        if isinstance(before, Arc) or isinstance(after, Arc):
            assume(min(before.length, after.length) > 1e-2)
            arriving = before.at(before.length) - before.at(before.length - 1e-4)
            leaving = after.at(1e-4) - after.at(0)
            assert phase(leaving / arriving) == pytest.approx(0, abs=1e-2)


@given(PLACES, st.floats(-pi, pi), st.integers(1, 900), st.floats(-pi, pi))
def test_between_its_cuts_an_arc_only_nears_the_origin_or_only_leaves_it(
    centre: complex, begin: float, radius: int, turn: float
) -> None:
    assume(abs(turn) > 1e-3)
    arc = Arc(centre, rect(radius, begin), turn, radius * abs(turn))
    assert (arc.cuts()[0], arc.cuts()[-1]) == (0, arc.length)
    for first, last in pairwise(arc.cuts()):
        far = [abs(arc.at(first + (last - first) * share / 8)) for share in range(9)]
        steps = [after - before for before, after in pairwise(far)]
        assert all(step >= -1e-6 for step in steps) or all(step <= 1e-6 for step in steps)


# Positions along a path


def positions(
    robot: Mechanics, start: Sequence[int], knots: Sequence[Sequence[Knot]], along: float
) -> list[float]:
    """The axes' positions at a place along the path, on the straight lines between the knots."""

    def at(knots: Sequence[Knot]) -> float:
        place = min(bisect_right(knots, along, key=lambda knot: knot.along), len(knots) - 1)
        before, after = knots[place - 1], knots[place]
        return before.pulses + (along - before.along) / (after.along - before.along) * (
            after.pulses - before.pulses
        )

    return [begun + at(track) for begun, track in zip(start, knots, strict=True)]


def along_path(
    robot: Mechanics, start: Sequence[int], segments: Sequence[Segment], turn: float = 0.0
) -> tuple[Path, list[list[Knot]]]:
    path = Path(robot, robot.pose(start), segments, turn)
    return path, [path.knots(axis) for axis in range(robot.axes)]


def here(robot: Mechanics, pose: Pose) -> complex:
    return rect(robot.lead(pose), pose.heading)


def test_a_line_that_ends_in_the_origin_has_no_piece_of_no_length() -> None:
    """Its nearest point is its end, but for rounding."""
    line = StraightLine(-129_003.08810741731 - 171_997.68387612054j, 0j)
    assert line.cuts() == [0.0, line.length]
    pose = Pose(-215_000, phase(-line.start), 0.0)
    assert Path(ROBOT, pose, [line]).knots(1)[-1].pulses == pytest.approx(10_000)


@settings(max_examples=30)
@given(
    base=st.integers(-60_000, 60_000),
    arm=st.integers(-29_000, 29_000),
    wrist=st.integers(-50_000, 50_000),
    reach=st.floats(0, 429_000),
    heading=st.floats(-pi, pi),
)
def test_the_wrist_stays_on_its_line_and_the_finger_keeps_its_direction(
    base: int, arm: int, wrist: int, reach: float, heading: float
) -> None:
    start = (base, arm, wrist)
    pose = ROBOT.pose(start)
    line = StraightLine(here(ROBOT, pose), rect(reach, heading))
    assume(line.length > 10)
    assume(min(abs(line.at(along)) for along in line.cuts()) > 5_000)
    path, knots = along_path(ROBOT, start, [line])
    pulse_um = max(2 * pi * 760_000 / turn for turn in ROBOT.pulses_per_turn)
    for step in range(21):
        along = path.length * step / 20
        reached = ROBOT.pose(positions(ROBOT, start, knots, along))
        assert here(ROBOT, reached) == pytest.approx(line.at(along), abs=3 * TOLERANCE_PULSES * pulse_um)
        assert reached.finger == pytest.approx(pose.finger, abs=3 * TOLERANCE_PULSES * 2 * pi / 60_000)


def test_the_elbow_keeps_its_bend() -> None:
    """A line with either bend of the elbow: the arm's axis turns the other way."""
    bent = [ROBOT.pose((0, arm, 0)) for arm in (-10_000, 10_000)]
    turned = []
    for pose in bent:
        start = here(ROBOT, pose)
        path = Path(ROBOT, pose, [StraightLine(start, start * 1.5)])
        turned.append(path.knots(1)[-1].pulses)
    assert turned[0] == pytest.approx(-turned[1])
    assert turned[0] < 0


def test_through_the_centre_the_base_turns_as_little_as_the_arm_asks() -> None:
    pose = ROBOT.pose(START)
    start = here(ROBOT, pose)
    through = Path(ROBOT, pose, [StraightLine(start, 0j), StraightLine(0j, -start)])
    assert [through.knots(axis)[-1].pulses for axis in range(3)] == pytest.approx(
        [121_791.045 / 6, 20_000, -100_000 / 6]
    )


def test_a_path_over_the_centre_and_back_turns_everything_back() -> None:
    pose = ROBOT.pose(START)
    start = here(ROBOT, pose)
    path = Path(ROBOT, pose, [StraightLine(start, 0j), StraightLine(0j, start)])
    assert [path.knots(axis)[-1].pulses for axis in range(3)] == pytest.approx([0, 0, 0], abs=1e-6)


@pytest.mark.parametrize("beside_um", [0, 3])
def test_a_line_past_the_centre_turns_the_base_round_there(beside_um: int) -> None:
    """13.10.6 warns of such paths: within a few micrometres the base makes half a turn."""
    pose = ROBOT.pose(START)
    start = here(ROBOT, pose) + beside_um
    knots = Path(ROBOT, ROBOT.pose(START), [StraightLine(start, start - 2 * (start - beside_um))]).knots(0)
    middle = knots[-1].along / 2
    around = [knot.pulses for knot in knots if abs(knot.along - middle) <= 100]
    assert max(around) - min(around) > 121_791 * 0.45
    assert abs(knots[-1].pulses) == pytest.approx(121_791.045 / 2, abs=2)


def test_belts_lead_the_finger_end_on_its_line() -> None:
    start = (1_000, 3_000)
    pose = BELTS.pose(start)
    line = StraightLine(here(BELTS, pose), complex(200_000, -50_000))
    path, knots = along_path(BELTS, start, [line])
    for step in range(21):
        along = path.length * step / 20
        x, y, _ = BELTS.place(positions(BELTS, start, knots, along))
        assert hypot(x - line.at(along).real, y - line.at(along).imag) < 3


def test_a_turning_finger_takes_its_share_of_the_path() -> None:
    pose = ROBOT.pose(START)
    arm = rect(-150_000, pose.finger)
    arc = Arc(here(ROBOT, pose) - arm, arm, -0.5, 90_000)
    path, knots = along_path(ROBOT, START, [arc], -0.5)
    for step in range(21):
        reached = ROBOT.pose(positions(ROBOT, START, knots, path.length * step / 20))
        assert reached.finger - pose.finger == pytest.approx(-0.5 * step / 20, abs=2e-5)
        pivot = here(ROBOT, reached) + rect(150_000, reached.finger)
        assert pivot == pytest.approx(arc.centre, abs=10)


def test_over_the_origin_the_finger_turns_alone() -> None:
    pose = ROBOT.pose((12_345, 0, 0))
    knots = [Path(ROBOT, pose, [Arc(0j, 0j, 1.0, 330_000)], 1.0).knots(axis) for axis in range(3)]
    assert [track[-1].pulses for track in knots] == pytest.approx([0, 0, -100_000 / (2 * pi)])


@pytest.mark.parametrize("end", [431_000 + 0j, 304_500 + 304_500j])
def test_a_line_out_of_reach_is_refused(end: complex) -> None:
    pose = ROBOT.pose(START)
    with pytest.raises(OutOfReach):
        Path(ROBOT, pose, [StraightLine(here(ROBOT, pose), end)]).knots(0)


def test_belts_with_a_long_finger_cannot_cross_the_middle() -> None:
    """The ends are within reach, the middle of the line is not."""
    robot = BeltLinked(50_000, 208_000, (98_765.0, 99_000.0))
    start = (0, 0)
    pose = robot.pose(start)
    crossing = [StraightLine(208_000 + 0j, rect(208_000, 2.5))]
    with pytest.raises(OutOfReach):
        Path(robot, pose, crossing).knots(1)
