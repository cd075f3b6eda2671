"""JOG: axes that move until a stop (C-HOST manual 2-2)."""

from math import copysign

from protocols.fics.jog import StartJog, StopJog
from protocols.fics.status import MotionMode
from simulator.fics.actions import Code, Refused, acts_out
from simulator.fics.acts.moves import HAND_PERCENT, Frame, named_axis, single, until_ended
from simulator.fics.axes import Motor
from simulator.fics.course import Span, stroke
from simulator.fics.robot import Robot

BEYOND = 1.0
"""Behind the limit sensor, in units: there an axis runs to that is not homed, and so is stopped by it."""


@acts_out(StartJog)
def _start_jog(robot: Robot, command: StartJog, now: float) -> None:
    """Jog to the soft limit, or onto the limit sensor where no coordinate is known.

    While axes jog, other motors may join; converted axes jog alone.
    """
    frame, axis = named_axis(robot.unit, command.axis)
    course = robot.unit.course
    if course is not None and (course.converted or frame.is_converted(axis) or course.moves(axis)):
        raise Refused(Code.BUSY)
    spans = {axis: Span(frame.places[axis], _end(frame, axis, 1.0 if command.direction == "+" else -1.0))}
    frame.check(spans)
    if frame.is_converted(axis):
        start, target = spans[axis].start, spans[axis].target
        spans = {axis: Span(start, start + (target - start) * frame.unit.free_share(spans))}
    if course is None:
        task = until_ended(frame.course(spans, {axis: HAND_PERCENT}, now))
        robot.begin(StartJog.code, MotionMode.JOG, task, now, answered=True)
    else:
        ramps = {axis: frame.axes[axis].ramps(HAND_PERCENT, frame.unit.s_curve)}
        course.start(single(stroke(spans, ramps, now)))


def _end(frame: Frame, axis: int, direction: float) -> float:
    """Give the coordinate at which a JOG ends: the soft limit, or beyond the limit sensor if not homed.

    :raises Refused: E07, the axis is beyond its soft limit.
    """
    target = frame.axes[axis]
    if frame.homed(axis) or not isinstance(target, Motor):
        limit = target.plus_limit if direction > 0 else target.minus_limit
        if (limit - frame.places[axis]) * direction < 0:
            raise Refused(Code.SOFT_LIMIT)
        return limit
    world = target.world
    return (
        (world.plus_limit if direction > 0 else world.minus_limit) - target.zero + copysign(BEYOND, direction)
    )


@acts_out(StopJog)
def _stop_jog(robot: Robot, command: StopJog, now: float) -> None:
    """Ramp one axis down; one that does not jog stays as it is."""
    _, axis = named_axis(robot.unit, command.axis)
    course = robot.unit.course
    if robot.jogging() and course is not None:
        course.brake(now, axis)
