"""What is set for the interpolation of a SCARA robot, and its coordinates: commands H (RC-420 manual 13.10).

Interpolated moves are not acted out, nor are the coordinates of robots with belts.
"""

from dataclasses import replace

from protocols.rorze.interpolation import (
    ArmLength,
    AxisPositions,
    ConvertCoordinatesToPulses,
    ConvertPulsesToCoordinates,
    Coordinates,
    DrivenAxis,
    FingerLength,
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
    RobotTypeReply,
    SetArmLength,
    SetDrivenAxis,
    SetFingerLength,
    SetPathPoint,
    SetPulsesPerTurn,
    SetRobotType,
    SetStartPosition,
)
from protocols.rorze.notation import PositionReference
from protocols.rorze.position import SignedPulses
from simulator.rorze.actions import BAD_PARAMETER, UNKNOWN_CODE, Refused, acts_out
from simulator.rorze.acts.position_table import number_of, step_index
from simulator.rorze.controller import Rc420
from simulator.rorze.scara import Scara
from simulator.rorze.settings import FARTHEST

ROBOT_TYPES = ("three_axes", "two_axes_belt_linked")
THREE_AXES = 0

OUT_OF_REACH = 0x63


def _measured(axis: Rc420, given: Measure) -> int:
    """A number, or what stands in the position table; the index steps at each use, an assumption."""
    if isinstance(given, int):
        return given
    value = axis.positions[number_of(axis, given)]
    step_index(axis, given)
    return value


@acts_out(GetArmLength)
def get_arm_length(axis: Rc420, command: GetArmLength, now: float) -> ArmLength:
    return ArmLength(length=axis.settings.arm_length)


@acts_out(SetArmLength)
def set_arm_length(axis: Rc420, command: SetArmLength, now: float) -> None:
    axis.settings = replace(axis.settings, arm_length=command.length)


@acts_out(GetFingerLength)
def get_finger_length(axis: Rc420, command: GetFingerLength, now: float) -> FingerLength:
    return FingerLength(length=axis.settings.wafer_distance)


@acts_out(SetFingerLength)
def set_finger_length(axis: Rc420, command: SetFingerLength, now: float) -> None:
    axis.settings = replace(axis.settings, wafer_distance=command.length)


@acts_out(GetDrivenAxis)
def get_driven_axis(axis: Rc420, command: GetDrivenAxis, now: float) -> DrivenAxis:
    return DrivenAxis(axis=axis.settings.axis_role)


@acts_out(SetDrivenAxis)
def set_driven_axis(axis: Rc420, command: SetDrivenAxis, now: float) -> None:
    axis.settings = replace(axis.settings, axis_role=command.axis)


@acts_out(GetRobotType)
def get_robot_type(axis: Rc420, command: GetRobotType, now: float) -> RobotTypeReply:
    return RobotTypeReply.model_validate({"robot": ROBOT_TYPES[axis.settings.interpolation]})


@acts_out(SetRobotType)
def set_robot_type(axis: Rc420, command: SetRobotType, now: float) -> None:
    axis.settings = replace(axis.settings, interpolation=ROBOT_TYPES.index(command.robot))


@acts_out(GetPulsesPerTurn)
def get_pulses_per_turn(axis: Rc420, command: GetPulsesPerTurn, now: float) -> PulsesPerTurn:
    return PulsesPerTurn(pulses=axis.settings.resolutions[command.axis])


@acts_out(SetPulsesPerTurn)
def set_pulses_per_turn(axis: Rc420, command: SetPulsesPerTurn, now: float) -> None:
    axis.settings = axis.settings.with_item("resolutions", command.axis, command.pulses)


@acts_out(GetStartPosition)
def get_start_position(axis: Rc420, command: GetStartPosition, now: float) -> SignedPulses:
    return SignedPulses(pulses=axis.start_positions[command.axis])


@acts_out(SetStartPosition)
def set_start_position(axis: Rc420, command: SetStartPosition, now: float) -> None:
    axis.start_positions[command.axis] = _measured(axis, command.position)


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
    x, y, radius = (_measured(axis, given) for given in (command.x, command.y, command.radius))
    if radius < 0:
        raise Refused(BAD_PARAMETER)
    return PathPoint(x=x, y=y, radius=radius)


# Coordinates


def _robot(axis: Rc420) -> Scara:
    """The robot as it has been described.

    :raises Refused: 49 where it has belts: the manual does not tell where its axes stand at 0.
    """
    settings = axis.settings
    if settings.interpolation != THREE_AXES:
        raise Refused(UNKNOWN_CODE)
    return Scara(settings.arm_length, settings.wafer_distance, settings.resolutions[:3])


@acts_out(ConvertPulsesToCoordinates)
def get_coordinates(axis: Rc420, command: ConvertPulsesToCoordinates, now: float) -> Coordinates:
    robot = _robot(axis)
    pulses = _axis_positions(axis, command)
    x, y, angle = robot.place(pulses)
    if max(map(abs, (x, y, angle))) > FARTHEST:
        raise Refused(BAD_PARAMETER)
    return Coordinates(x=x, y=y, angle=angle)


def _axis_positions(axis: Rc420, command: ConvertPulsesToCoordinates) -> tuple[int, ...]:
    """Those given, or without any those set by HPS.

    :raises Refused: 4A where that of an axis is missing.
    """
    given = (command.axis_0, command.axis_1, command.axis_2)
    if given == (None, None, None):
        return tuple(axis.start_positions[:3])
    return tuple(_measured(axis, _required(position)) for position in given)


@acts_out(ConvertCoordinatesToPulses)
def get_axis_positions(axis: Rc420, command: ConvertCoordinatesToPulses, now: float) -> AxisPositions:
    robot = _robot(axis)
    given = (command.x, command.y, command.angle)
    x, y, angle = (_measured(axis, _required(value)) for value in given)
    pulses = robot.pulses(x, y, angle)
    if pulses is None:
        raise Refused(OUT_OF_REACH)
    return AxisPositions(axis_0=pulses[0], axis_1=pulses[1], axis_2=pulses[2])


def _required(value: int | PositionReference | None) -> int | PositionReference:
    """What robots with three axes need (RC-420 manual 14.H).

    :raises Refused: 4A where it is missing.
    """
    if value is None:
        raise Refused(BAD_PARAMETER)
    return value
