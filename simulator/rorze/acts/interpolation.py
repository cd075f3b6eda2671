"""The settings of interpolated moves, and a SCARA robot's coordinates: commands H (RC-420 manual 13.10)."""

from collections.abc import Iterator
from contextlib import contextmanager

from protocols.rorze.interpolation import (
    AxisPositions,
    ConvertCoordinatesToPulses,
    ConvertPulsesToCoordinates,
    Coordinates,
    GetArmLength,
    GetDrivenAxis,
    GetFingerLength,
    GetPathPoint,
    GetPulsesPerTurn,
    GetRobotType,
    GetStartPosition,
    Measure,
    PathPoint,
    PulsesPerTurn,
    SetArmLength,
    SetDrivenAxis,
    SetFingerLength,
    SetPathPoint,
    SetPulsesPerTurn,
    SetRobotType,
    SetStartPosition,
)
from protocols.rorze.path import PathFault
from protocols.rorze.position import SignedPulses
from protocols.rorze.scara import BeltLinked, FingerPlace, Mechanics, OutOfReach, ThreeAxes
from simulator.rorze.actions import BAD_PARAMETER, Refused, acts_out
from simulator.rorze.acts.kept import keeps
from simulator.rorze.acts.position_table import number_of, step_index
from simulator.rorze.controller import Rc420
from simulator.rorze.settings import FARTHEST

ROBOT_TYPES = ("three_axes", "two_axes_belt_linked")
ROBOTS = (ThreeAxes, BeltLinked)

NOT_SET_UP, OUT_OF_REACH, BAD_INTERPOLATION = 0x61, 0x63, 0x64
"""An assumption: the pages do not list them, but chapter 21 has them for this."""


def measured(axis: Rc420, given: Measure) -> int:
    """A number, or what stands in the position table; the index steps at each use, an assumption."""
    if isinstance(given, int):
        return given
    value = axis.positions[number_of(axis, given)]
    step_index(axis, given)
    return value


keeps(GetArmLength, SetArmLength, "arm_length")
keeps(GetFingerLength, SetFingerLength, "wafer_distance")
keeps(GetDrivenAxis, SetDrivenAxis, "axis_role")
keeps(GetRobotType, SetRobotType, "interpolation", ROBOT_TYPES)


@acts_out(GetPulsesPerTurn)
def get_pulses_per_turn(axis: Rc420, command: GetPulsesPerTurn, now: float) -> PulsesPerTurn:
    return PulsesPerTurn(pulses=axis.settings.resolutions[command.axis])


@acts_out(SetPulsesPerTurn)
def set_pulses_per_turn(axis: Rc420, command: SetPulsesPerTurn, now: float) -> None:
    axis.settings = axis.settings.with_item("resolutions", command.axis, command.pulses)


@acts_out(GetStartPosition)
def get_start_position(axis: Rc420, command: GetStartPosition, now: float) -> SignedPulses:
    return SignedPulses(pulses=axis.start_positions.get(command.axis, 0))


@acts_out(SetStartPosition)
def set_start_position(axis: Rc420, command: SetStartPosition, now: float) -> None:
    axis.start_positions[command.axis] = measured(axis, command.position)


# Paths


@acts_out(GetPathPoint)
def get_path_point(axis: Rc420, command: GetPathPoint, now: float) -> PathPoint:
    return axis.paths.get(command.path, {}).get(command.point, PathPoint())


@acts_out(SetPathPoint)
def set_path_point(axis: Rc420, command: SetPathPoint, now: float) -> None:
    if command.point is None:
        axis.paths.pop(command.path, None)
    else:
        axis.paths.setdefault(command.path, {})[command.point] = _point(axis, command)


def _point(axis: Rc420, command: SetPathPoint) -> PathPoint:
    """The point itself, wherever its numbers stand.

    :raises Refused: 4A where the position table holds a negative radius.
    """
    if command.x is None or command.y is None or command.radius is None:
        return PathPoint(place=command.place)
    x, y, radius = (measured(axis, given) for given in (command.x, command.y, command.radius))
    if radius < 0:
        raise Refused(BAD_PARAMETER)
    return PathPoint(x=x, y=y, radius=radius)


# The robot


def robot_of(axis: Rc420) -> Mechanics:
    """The robot as it has been described."""
    settings = axis.settings
    kind = ROBOTS[settings.interpolation]
    return kind(settings.arm_length, settings.wafer_distance, settings.resolutions[: kind.axes])


def told_positions(axis: Rc420, robot: Mechanics) -> tuple[int, ...]:
    """The places of the robot's axes that HPS has set, true or not.

    :raises Refused: 61 where it has not told one since the power came.
    """
    if not all(number in axis.start_positions for number in range(robot.axes)):
        raise Refused(NOT_SET_UP)
    return tuple(axis.start_positions[number] for number in range(robot.axes))


@contextmanager
def refusing() -> Iterator[None]:
    """Answer 63 where the arm does not reach, and 64 where no path can be made."""
    try:
        yield
    except OutOfReach:
        raise Refused(OUT_OF_REACH) from None
    except PathFault:
        raise Refused(BAD_INTERPOLATION) from None


# Coordinates


@acts_out(ConvertPulsesToCoordinates)
def get_coordinates(axis: Rc420, command: ConvertPulsesToCoordinates, now: float) -> Coordinates:
    robot = robot_of(axis)
    with refusing():
        x, y, angle = map(round, robot.place(_axis_positions(axis, robot, command)))
    if max(map(abs, (x, y, angle))) > FARTHEST:
        raise Refused(BAD_PARAMETER)
    return Coordinates(x=x, y=y, angle=angle)


def _axis_positions(axis: Rc420, robot: Mechanics, command: ConvertPulsesToCoordinates) -> tuple[int, ...]:
    """The given positions, or without any those set by HPS.

    :raises Refused: 4A where that of an axis is missing, 61 where HPS has not told it.
    """
    given = (command.axis_0, command.axis_1, command.axis_2)
    if given == (None, None, None):
        return told_positions(axis, robot)
    return tuple(measured(axis, _required(position)) for position in given[: robot.axes])


@acts_out(ConvertCoordinatesToPulses)
def get_axis_positions(axis: Rc420, command: ConvertCoordinatesToPulses, now: float) -> AxisPositions:
    robot = robot_of(axis)
    direction = 0 if isinstance(robot, BeltLinked) else _required(command.angle)
    with refusing():
        place = FingerPlace(*(measured(axis, value) for value in (command.x, command.y, direction)))
        base, arm, *finger = robot.whole_pulses(place)
    return AxisPositions(axis_0=base, axis_1=arm, axis_2=finger[0] if finger else None)


def _required(value: Measure | None) -> Measure:
    """Require a measure of the robot (RC-420 manual 14.H).

    :raises Refused: 4A where it is missing.
    """
    if value is None:
        raise Refused(BAD_PARAMETER)
    return value
