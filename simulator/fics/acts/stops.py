"""Software stops (C-HOST manual 2-7, 2-8)."""

from protocols.fics.stops import StopAllDecelerating, StopAllImmediately
from simulator.fics.actions import Code, Outcome, Refused, acts_out
from simulator.fics.alarms import emergency
from simulator.fics.robot import Robot


def _require_no_stop(robot: Robot) -> None:
    """Refuse a second stop, of whichever kind, while one is under way: an assumption.

    :raises Refused: E04.
    """
    if robot.braking is not None:
        raise Refused(Code.STOPPING)


@acts_out(StopAllImmediately)
def _stop_immediately(robot: Robot, command: StopAllImmediately, now: float) -> None:
    _require_no_stop(robot)
    robot.raise_alarm(emergency(), now)


@acts_out(StopAllDecelerating)
def _stop_decelerating(robot: Robot, command: StopAllDecelerating, now: float) -> Outcome:
    _require_no_stop(robot)
    return robot.brake(now)
