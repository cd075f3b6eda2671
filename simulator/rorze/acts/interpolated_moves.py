"""The moves of a SCARA robot: commands H (RC-420 manual 13.10, 14.H).

A controller calculates from the positions that HPS has told it, and then turns its axis by the difference,
wherever that really stands: stale positions lead the arm elsewhere.
"""

from protocols.rorze.interpolation import (
    MoveToExtensionStart,
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
from protocols.rorze.profile import Profile, plan
from protocols.rorze.scara import TURN, Mechanics, Pose
from protocols.rorze.ways import Turns, Way, about, along, by, end_of, finger_turns, out, turns_towards
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


def _start(axis: Rc420, now: float) -> tuple[Mechanics, Pose]:
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
    """Require that an axis may turn this way first; None is an axis that does not turn.

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


@acts_out(PrepareMoveAlongX)
def prepare_move_along_x(axis: Rc420, command: PrepareMoveAlongX, now: float) -> None:
    _prepare(axis, command, by(measured(axis, command.distance)), now)


@acts_out(PrepareMoveAlongY)
def prepare_move_along_y(axis: Rc420, command: PrepareMoveAlongY, now: float) -> None:
    _prepare(axis, command, by(1j * measured(axis, command.distance)), now)


@acts_out(PrepareArmExtension)
def prepare_arm_extension(axis: Rc420, command: PrepareArmExtension, now: float) -> None:
    _prepare(axis, command, out(measured(axis, command.distance)), now)


@acts_out(PrepareArmRetraction)
def prepare_arm_retraction(axis: Rc420, command: PrepareArmRetraction, now: float) -> None:
    _prepare(axis, command, out(-measured(axis, command.distance)), now)


@acts_out(PreparePath)
def prepare_path(axis: Rc420, command: PreparePath, now: float) -> None:
    _prepare(axis, command, along(axis.paths.get(command.path, {})), now)


@acts_out(PrepareFingerRotation)
def prepare_finger_rotation(axis: Rc420, command: PrepareFingerRotation, now: float) -> None:
    radius, angle = measured(axis, command.radius), measured(axis, command.angle)
    _prepare(axis, command, about(radius, angle), now)


# Moves


@acts_out(StartInterpolation)
def start_interpolation(axis: Rc420, command: StartInterpolation, now: float) -> None:
    """Begin the prepared move: changes of settings since the preparation do not alter it."""
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
        turns = finger_turns(robot, pose, measured(axis, command.angle))
    _turn(axis, command, turns, now)


@acts_out(MoveToExtensionStart)
def move_to_extension_start(axis: Rc420, command: MoveToExtensionStart, now: float) -> None:
    """Base and finger make a quarter turn at most; with belts, the base turns the finger to the target."""
    with refusing():
        robot, pose = _start(axis, now)
        turns = turns_towards(robot, pose, _target(axis, command))
    _turn(axis, command, turns, now)


def _target(axis: Rc420, command: MoveToExtensionStart) -> complex | None:
    """Where the finger is to end after the extension."""
    if command.path is not None:
        return end_of(axis.paths.get(command.path, {}))
    if command.x is None or command.y is None:
        return None
    return complex(measured(axis, command.x), measured(axis, command.y))


def _turn(axis: Rc420, command: TurnFinger | MoveToExtensionStart, turns: Turns, now: float) -> None:
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
