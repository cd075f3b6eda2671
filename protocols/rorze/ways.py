"""The ways of a SCARA robot's moves, from a pose on: commands H (RC-420 manual 13.10, 14.H).

Lengths are micrometres, places complex numbers, angles radians; those of commands thousandths of a degree.
"""

from cmath import phase, rect
from collections.abc import Callable, Mapping
from math import cos, pi, radians

from protocols.rorze.interpolation import PathPoint
from protocols.rorze.path import CLOSE_UM, Arc, Corner, Path, PathFault, rounded
from protocols.rorze.scara import TURN, Mechanics, Pose, ThreeAxes, within_half_turn

BASE_AXIS, FINGER_AXIS = 0, 2

Way = Callable[[Mechanics, Pose], Path]
"""A path, for a robot in a pose.

It raises `OutOfReach` or `PathFault` where there is none.
"""
Points = Mapping[int, PathPoint]
"""The via points of a path, by their numbers."""
Turns = Mapping[int, float]
"""Turns in radians by axis, each in the sense of rotation in which the axis counts."""


def by(distance: complex) -> Way:
    """Straight on: HXS, HYS."""

    def way(robot: Mechanics, pose: Pose) -> Path:
        here = _here(robot, pose)
        return Path(robot, pose, rounded(here, [Corner(here + distance)]))

    return way


def out(distance: float) -> Way:
    """Along the line of the arm, so that the finger goes ahead, through the origin if need be: H+S, H-S.

    Where the finger does not lie on that line, which way extends the arm is an assumption.
    """

    def way(robot: Mechanics, pose: Pose) -> Path:
        ahead = 1 if cos(pose.finger - pose.heading) >= 0 else -1
        lead = robot.lead(pose)
        end = lead + ahead * distance
        through = [Corner(0j)] if lead * end < 0 else []
        return Path(robot, pose, rounded(_here(robot, pose), [*through, Corner(rect(end, pose.heading))]))

    return way


def along(points: Points) -> Way:
    """From via point to via point: HMS.

    One that is missing between others makes a path unfit, an assumption.
    """

    def way(robot: Mechanics, pose: Pose) -> Path:
        corners: list[Corner] = []
        for point in _in_order(points):
            heading = phase(corners[-1].at) if corners else pose.heading
            corners.append(_corner(robot, point, heading, pose.finger))
        return Path(robot, pose, rounded(_here(robot, pose), corners))

    return way


def about(radius: float, angle: float) -> Way:
    """Turn the finger about one of its points to a direction: HRS.

    The shorter way round, at the speed of wrist or finger's end, what is farther out: assumptions.
    """

    def way(robot: Mechanics, pose: Pose) -> Path:
        turn = _finger_turn(robot, pose, angle)
        arm = rect(-radius, pose.finger)
        length = max(abs(radius), abs(robot.finger - radius)) * abs(turn)
        arc = Arc(_here(robot, pose) - arm, arm, turn, length)
        return Path(robot, pose, [arc] if length > CLOSE_UM else [], turn)

    return way


def finger_turns(robot: Mechanics, pose: Pose, angle: float) -> Turns:
    """Turn the finger alone to a direction, the shorter way round, an assumption: HFM.

    :raises PathFault: it has no axis of its own.
    """
    return {FINGER_AXIS: -_finger_turn(robot, pose, angle)}


def turns_towards(robot: Mechanics, pose: Pose, target: complex | None) -> Turns:
    """Turn base and finger to the line of a target, a quarter turn at most: HNM.

    With belts, the base turns the finger to the target.

    :raises PathFault: the target gives no direction.
    :raises OutOfReach: the arm does not come so far.
    """
    if target is None or abs(target) < CLOSE_UM:
        raise PathFault("The target gives no direction.")
    line = phase(target)
    robot.angles(Pose(abs(target) - robot.finger, line, line))
    around = within_half_turn(line - pose.heading, pi if isinstance(robot, ThreeAxes) else TURN)
    return {BASE_AXIS: around, FINGER_AXIS: within_half_turn(pose.finger + around - line, pi)}


def end_of(points: Points) -> complex | None:
    """Where the finger ends at the last point of a path; None where the wrist is to be over the origin.

    :raises PathFault: a point is missing.
    """
    ordered = _in_order(points)
    return _end(ordered[-1]) if ordered else None


def _here(robot: Mechanics, pose: Pose) -> complex:
    return rect(robot.lead(pose), pose.heading)


def _in_order(points: Points) -> list[PathPoint]:
    if set(points) != set(range(len(points))):
        raise PathFault("A point is missing.")
    return [points[number] for number in range(len(points))]


def _corner(robot: Mechanics, point: PathPoint, heading: float, finger: float) -> Corner:
    """The corner at a point, which must be within reach though the path may cut it."""
    end = _end(point)
    if end is None:
        return Corner(rect(robot.ahead, heading))
    at = robot.guide(end, finger)
    robot.angles(Pose(abs(at) - robot.ahead, heading, finger))
    return Corner(at, point.radius or 0)


def _end(point: PathPoint) -> complex | None:
    return None if point.x is None or point.y is None else complex(point.x, point.y)


def _finger_turn(robot: Mechanics, pose: Pose, angle: float) -> float:
    """Angle by which the finger has to turn, the shorter way, in radians."""
    if not isinstance(robot, ThreeAxes):
        raise PathFault("The finger has no axis of its own.")
    return within_half_turn(radians(angle / 1000) - pose.finger)
