"""The moves of a SCARA robot: commands H (RC-420 manual 13.10, 14.H).

A controller calculates from the positions that HPS has told it, and then turns its axis by the difference,
wherever that really stands: stale positions lead the arm elsewhere.
"""

from cmath import phase, rect
from collections.abc import Callable
from math import cos, pi, radians

from protocols.rorze.interpolation import (
    MoveToExtensionStart,
    PathPoint,
    Preparation,
    PrepareArmExtension,
    PrepareArmRetraction,
    PrepareFingerRotation,
    PrepareMoveAlongX,
    PrepareMoveAlongY,
    PreparePath,
    StartInterpolation,
    TurnFinger,
)
from protocols.rorze.path import CLOSE_UM, Arc, Corner, Path, PathFault, rounded
from protocols.rorze.profile import Profile, plan
from protocols.rorze.scara import TURN, Pose, Robot, ThreeAxes, within_half_turn
from simulator.rorze.actions import Refused, acts_out
from simulator.rorze.acts.interpolation import (
    BAD_INTERPOLATION,
    NOT_SET_UP,
    measured,
    refusing,
    robot_of,
    told_positions,
)
from simulator.rorze.acts.moves import STALLED, require_free, require_in_range, require_safe
from simulator.rorze.acts.patterns import ramps_of
from simulator.rorze.controller import Rc420
from simulator.rorze.course import Course, Prepared, Track
from simulator.rorze.motion import Direction
from simulator.rorze.motor import Leg, PathLeg, Pause, Task
from simulator.rorze.world import CCW, CW

FINGER_AXIS = 2

Way = Callable[[Robot, Pose], Path]
"""A path, for a robot in a pose."""


def _start(axis: Rc420, now: float) -> tuple[Robot, Pose]:
    """The robot, and how it stands as HPS has told.

    :raises Refused: 61 where an axis's position is missing, 64 where the robot has no such axis as this.
    """
    robot, role = robot_of(axis), axis.settings.axis_role
    if role >= robot.axes:
        raise Refused(BAD_INTERPOLATION)
    told = told_positions(axis, robot)
    if axis.refuses_stale_positions and told[role] != axis.position(now):
        raise Refused(BAD_INTERPOLATION)
    return robot, robot.pose(told)


def _require_free(axis: Rc420, direction: Direction | None) -> None:
    """What a move asks of an axis that turns this way first, or not at all.

    :raises Refused: 51, 52, 55 or 66.
    """
    if direction is not None:
        require_free(axis, direction)
        return
    require_safe(axis)
    if axis.stalls:
        raise Refused(STALLED)


# Preparation


def _prepare(axis: Rc420, command: Preparation, way: Way, now: float) -> None:
    up, down = ramps_of(axis, command.pattern)
    with refusing():
        robot, pose = _start(axis, now)
        track = Track(way(robot, pose).knots(axis.settings.axis_role))
    prepared = Prepared(track, plan(track.length, up, down))
    _require_free(axis, prepared.direction)
    axis.prepared = prepared


def _here(robot: Robot, pose: Pose) -> complex:
    return rect(robot.lead(pose), pose.heading)


def _by(distance: complex) -> Way:
    """Straight on."""

    def way(robot: Robot, pose: Pose) -> Path:
        here = _here(robot, pose)
        return Path(robot, pose, rounded(here, [Corner(here + distance)]))

    return way


def _out(distance: int) -> Way:
    """Along the line of the arm, so that the finger goes ahead; through the origin if need be.

    Where the finger does not lie on that line, which way extends the arm is an assumption.
    """

    def way(robot: Robot, pose: Pose) -> Path:
        ahead = 1 if cos(pose.finger - pose.heading) >= 0 else -1
        lead = robot.lead(pose)
        end = lead + ahead * distance
        through = [Corner(0j)] if lead * end < 0 else []
        return Path(robot, pose, rounded(_here(robot, pose), [*through, Corner(rect(end, pose.heading))]))

    return way


@acts_out(PrepareMoveAlongX)
def prepare_move_along_x(axis: Rc420, command: PrepareMoveAlongX, now: float) -> None:
    _prepare(axis, command, _by(measured(axis, command.distance)), now)


@acts_out(PrepareMoveAlongY)
def prepare_move_along_y(axis: Rc420, command: PrepareMoveAlongY, now: float) -> None:
    _prepare(axis, command, _by(1j * measured(axis, command.distance)), now)


@acts_out(PrepareArmExtension)
def prepare_arm_extension(axis: Rc420, command: PrepareArmExtension, now: float) -> None:
    _prepare(axis, command, _out(measured(axis, command.distance)), now)


@acts_out(PrepareArmRetraction)
def prepare_arm_retraction(axis: Rc420, command: PrepareArmRetraction, now: float) -> None:
    _prepare(axis, command, _out(-measured(axis, command.distance)), now)


@acts_out(PreparePath)
def prepare_path(axis: Rc420, command: PreparePath, now: float) -> None:
    def way(robot: Robot, pose: Pose) -> Path:
        corners: list[Corner] = []
        for point in _points(axis, command.path):
            heading = phase(corners[-1].at) if corners else pose.heading
            corners.append(_corner(robot, point, heading, pose.finger))
        return Path(robot, pose, rounded(_here(robot, pose), corners))

    _prepare(axis, command, way, now)


def _points(axis: Rc420, path: int) -> list[PathPoint]:
    """The points of a path; one that is missing between others makes it unfit, an assumption."""
    points = axis.paths.get(path, {})
    if set(points) != set(range(len(points))):
        raise PathFault("A point is missing.")
    return [points[number] for number in range(len(points))]


def _corner(robot: Robot, point: PathPoint, heading: float, finger: float) -> Corner:
    """The corner at a point, which must be within reach though the path may cut it."""
    end = _end(point)
    if end is None:
        return Corner(rect(robot.ahead, heading))
    at = robot.guide(end, finger)
    robot.angles(Pose(abs(at) - robot.ahead, heading, finger))
    return Corner(at, point.radius or 0)


def _end(point: PathPoint) -> complex | None:
    """Where the finger ends there; None where the wrist is to be over the origin."""
    return None if point.x is None or point.y is None else complex(point.x, point.y)


@acts_out(PrepareFingerRotation)
def prepare_finger_rotation(axis: Rc420, command: PrepareFingerRotation, now: float) -> None:
    """The shorter way round, at the speed of wrist or finger's end, what is farther out: assumptions."""
    radius, angle = measured(axis, command.radius), measured(axis, command.angle)

    def way(robot: Robot, pose: Pose) -> Path:
        turn = _finger_turn(robot, pose, angle)
        arm = rect(-radius, pose.finger)
        length = max(abs(radius), abs(robot.finger - radius)) * abs(turn)
        arc = Arc(_here(robot, pose) - arm, arm, turn, length)
        return Path(robot, pose, [arc] if length > CLOSE_UM else [], turn)

    _prepare(axis, command, way, now)


def _finger_turn(robot: Robot, pose: Pose, angle: int) -> float:
    """By how much the finger has to turn, the shorter way.

    :raises Refused: 64 where it has no axis of its own.
    """
    if not isinstance(robot, ThreeAxes):
        raise Refused(BAD_INTERPOLATION)
    return within_half_turn(radians(angle / 1000) - pose.finger)


# Moves


@acts_out(StartInterpolation)
def start_interpolation(axis: Rc420, command: StartInterpolation, now: float) -> None:
    """Whatever has happened since the preparation does not change the move."""
    prepared = axis.prepared
    if prepared is None:
        raise Refused(NOT_SET_UP)
    require_in_range(axis, axis.position(now) + prepared.track.pulses)
    _require_free(axis, prepared.direction)
    axis.prepared = None
    axis.start(command.code, _along(Course(prepared.track, prepared.profile.starting_at(now))), now)


def _along(course: Course) -> Task:
    """One leg after another, each in one direction; an axis that does not turn waits for the others."""
    for stretch in course.track.stretches:
        yield PathLeg(course, stretch)
    if course.track.length and not course.track.stretches and course.profile.end_s is not None:
        yield Pause(course.profile.end_s)


@acts_out(TurnFinger)
def turn_finger(axis: Rc420, command: TurnFinger, now: float) -> None:
    """The shorter way round, an assumption."""
    with refusing():
        robot, pose = _start(axis, now)
    turn = -_finger_turn(robot, pose, measured(axis, command.angle))
    _turn(axis, command, {FINGER_AXIS: turn}, now)


@acts_out(MoveToExtensionStart)
def move_to_extension_start(axis: Rc420, command: MoveToExtensionStart, now: float) -> None:
    """Base and finger make a quarter turn at most; with belts, the base turns the finger to the target."""
    with refusing():
        robot, pose = _start(axis, now)
        target = _target(axis, command)
        line = phase(target)
        robot.angles(Pose(abs(target) - robot.finger, line, line))
    around = within_half_turn(line - pose.heading, pi if isinstance(robot, ThreeAxes) else TURN)
    finger = within_half_turn(pose.finger + around - line, pi)
    _turn(axis, command, {0: around, FINGER_AXIS: finger}, now)


def _target(axis: Rc420, command: MoveToExtensionStart) -> complex:
    """Where the finger is to end after the extension."""
    if command.path is not None:
        points = _points(axis, command.path)
        target = _end(points[-1]) if points else None
    elif command.x is not None and command.y is not None:
        target = complex(measured(axis, command.x), measured(axis, command.y))
    if target is None or abs(target) < CLOSE_UM:
        raise PathFault("The target gives no direction.")
    return target


def _turn(
    axis: Rc420, command: TurnFinger | MoveToExtensionStart, turns: dict[int, float], now: float
) -> None:
    """Turn this controller's axis, at a speed in pps; one that has nothing to turn is done at once.

    That each axis goes by its own clock is an assumption.
    """
    up, down = ramps_of(axis, command.pattern)
    role = axis.settings.axis_role
    pulses = round(turns.get(role, 0.0) / TURN * axis.settings.resolutions[role])
    direction = (CW if pulses > 0 else CCW) if pulses else None
    require_in_range(axis, axis.position(now) + pulses)
    _require_free(axis, direction)
    axis.start(command.code, _straight(direction, plan(abs(pulses), up, down)), now)


def _straight(direction: Direction | None, profile: Profile) -> Task:
    if direction is not None:
        yield Leg(direction, profile)
