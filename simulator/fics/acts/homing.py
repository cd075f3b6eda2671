"""Homing of all axes (C-HOST manual 2-4)."""

from protocols.fics.homing import HomeRobot
from protocols.fics.status import MotionMode
from simulator.fics.actions import Code, Refused, Task, plans
from simulator.fics.acts.moves import until_ended
from simulator.fics.course import Course
from simulator.fics.homing import Search
from simulator.fics.robot import Robot


@plans(MotionMode.HOMING, HomeRobot)
def _home(robot: Robot, command: HomeRobot, now: float) -> Task:
    """Home every motor of every unit, all at a time: an assumption."""
    motors = [motor for unit in robot.units.values() for motor in unit.motors]
    if not all(motor.ready() for motor in motors):
        raise Refused(Code.ALARM)
    courses = []
    for unit in robot.units.values():
        course = Course(unit)
        for place, motor in enumerate(unit.motors):
            course.start(Search(motor, place).route(now))
        courses.append(course)
    return until_ended(*courses)
