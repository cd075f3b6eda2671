"""Moves to places and by amounts, in user and in motor coordinates (C-HOST manual 2-3, 2-5, 2-6, 2-16, 4)."""

from collections.abc import Mapping, Sequence

from protocols.fics.jog import StepAxis
from protocols.fics.motor_axes import MoveMotorsAbsolute, MoveMotorsRelative
from protocols.fics.moves import AxesMove, MoveAbsolute, MoveRelative, MoveToPosition
from protocols.fics.notation import Quantity
from protocols.fics.status import MotionMode
from simulator.fics.actions import Alarmed, Code, Refused, Task, plans
from simulator.fics.alarms import unreachable
from simulator.fics.axes import Axis, Motor
from simulator.fics.course import Course, Route, Span, Stroke, stroke
from simulator.fics.geometry import OutOfReach, Places
from simulator.fics.robot import Robot
from simulator.fics.units import BeyondLimits, Unit

HAND_PERCENT = 10.0
"""The part of the top speed for JOG and JTE: an assumption."""


def single(stroke: Stroke) -> Route:
    """A route of one stroke."""
    yield stroke


def until_ended(*courses: Course) -> Task:
    """A task that is done when the motion is."""
    return (yield courses)


class Frame:
    """The axes of a unit in user or motor coordinates, and where they are."""

    def __init__(self, unit: Unit, *, motors: bool) -> None:
        self.unit = unit
        self.motors = motors
        self.axes: Sequence[Axis] = unit.motors if motors else unit.users
        self.places: Places = unit.at_rest() if motors else unit.geometry.to_user(unit.at_rest())

    def percent(self, axis: int) -> float:
        """The axis's share of the top speed: by VAO, or by MAO as a motor (C-HOST manual 2-15, 4-5)."""
        return self.unit.motors[axis].motor_percent if self.motors else self.axes[axis].percent

    def is_converted(self, axis: int) -> bool:
        """Tell whether the axis is not a motor itself."""
        return not self.motors and self.unit.is_converted(axis)

    def homed(self, axis: int) -> bool:
        """Tell whether its coordinate means anything."""
        return all(motor.homed for motor in self._motors(axis))

    def _motors(self, axis: int) -> Sequence[Motor]:
        """The motors that move the axis."""
        return self.unit.motors[axis : axis + 1] if self.motors else self.unit.motors_of(axis)

    def check(self, spans: Mapping[int, Span]) -> None:
        """Check what any move asks of its axes; soft limits hold only where coordinates mean something.

        :raises Refused: E02 a driver cannot move, E07 a soft limit, E10 not homed as the conversion needs it.
        """
        if any(self.is_converted(axis) and not self.homed(axis) for axis in spans):
            raise Refused(Code.IMPOSSIBLE)
        if not all(motor.ready() for axis in spans for motor in self._motors(axis)):
            raise Refused(Code.ALARM)
        for axis, span in spans.items():
            if self.homed(axis) and not self.axes[axis].within_limits(span.target):
                raise Refused(Code.SOFT_LIMIT)

    def course(self, spans: Mapping[int, Span], percents: Mapping[int, float], now: float) -> Course:
        """Set axes moving.

        :raises Refused: E07, a motor would leave its soft limits on the way.
        :raises Alarmed: the arms cannot follow.
        """
        converted = any(map(self.is_converted, spans))
        if converted:
            _require_free_way(self.unit, spans)
        ramps = {axis: self.axes[axis].ramps(percents[axis], self.unit.s_curve) for axis in spans}
        course = Course(self.unit, converted=converted)
        course.start(single(stroke(spans, ramps, now)))
        return course


def _require_free_way(unit: Unit, spans: Mapping[int, Span]) -> None:
    try:
        unit.require_free_way(spans)
    except BeyondLimits:
        raise Refused(Code.SOFT_LIMIT) from None
    except OutOfReach:
        raise Alarmed(unreachable()) from None


def _whole_where_needed(axis: Axis, value: float) -> bool:
    return axis.measure.system.can_hold(Quantity.POSITION, value)


def _move(frame: Frame, values: Sequence[float | None], now: float, *, relative: bool) -> Task:
    """Start a move of the given axes at their share of the top speed.

    :raises Refused: E05, E06, E07 or E10; an absolute move needs its axes homed.
    """
    if len(values) > len(frame.axes):
        raise Refused(Code.FORMAT)
    given = {axis: value for axis, value in enumerate(values) if value is not None}
    if not all(_whole_where_needed(frame.axes[axis], value) for axis, value in given.items()):
        raise Refused(Code.RANGE)
    if not relative and not all(map(frame.homed, given)):
        raise Refused(Code.IMPOSSIBLE)
    spans = {
        axis: Span(frame.places[axis], value + (frame.places[axis] if relative else 0.0))
        for axis, value in given.items()
    }
    frame.check(spans)
    return until_ended(frame.course(spans, {axis: frame.percent(axis) for axis in spans}, now))


@plans(MotionMode.MOVE, MoveRelative, MoveMotorsRelative)
def _move_by(robot: Robot, command: AxesMove, now: float) -> Task:
    frame = Frame(robot.unit, motors=isinstance(command, MoveMotorsRelative))
    return _move(frame, command.coordinates, now, relative=True)


@plans(MotionMode.MOVE, MoveAbsolute, MoveMotorsAbsolute)
def _move_to(robot: Robot, command: AxesMove, now: float) -> Task:
    frame = Frame(robot.unit, motors=isinstance(command, MoveMotorsAbsolute))
    return _move(frame, command.coordinates, now, relative=False)


@plans(MotionMode.MOVE, MoveToPosition)
def _move_to_position(robot: Robot, command: MoveToPosition, now: float) -> Task:
    position = robot.unit.positions.get(command.position)
    if position is None:
        raise Refused(Code.NO_POSITION)
    return _move(Frame(robot.unit, motors=False), position, now, relative=False)


def named_axis(unit: Unit, name: str) -> tuple[Frame, int]:
    """Find an axis by its name, among the user axes first.

    :raises Refused: E05, there is none.
    """
    for frame in (Frame(unit, motors=False), Frame(unit, motors=True)):
        for place, axis in enumerate(frame.axes):
            if axis.name == name:
                return frame, place
    raise Refused(Code.RANGE)


@plans(MotionMode.MOVE, StepAxis)
def _step_axis(robot: Robot, command: StepAxis, now: float) -> Task:
    frame, axis = named_axis(robot.unit, command.axis)
    start = frame.places[axis]
    spans = {axis: Span(start, start + command.steps * frame.axes[axis].measure.step)}
    frame.check(spans)
    return until_ended(frame.course(spans, {axis: HAND_PERCENT}, now))
