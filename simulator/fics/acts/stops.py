"""Software stops (C-HOST manual 2-7, 2-8)."""

from protocols.fics.stops import StopAllDecelerating, StopAllImmediately
from simulator.fics.actions import Code, Outcome, Refused, acts_out
from simulator.fics.alarms import emergency
from simulator.fics.robot import Robot


@acts_out(StopAllImmediately)
def _stop_immediately(robot: Robot, command: StopAllImmediately, now: float) -> None:
    """Stop now, whatever is braking: but for (b) nothing keeps AES from it (C-HOST manual 1-7)."""
    if robot.braking is not None and robot.settings.stop_while_braking == "refused":
        raise Refused(Code.STOPPING)
    robot.raise_alarm(emergency(), now)


@acts_out(StopAllDecelerating)
def _stop_decelerating(robot: Robot, command: StopAllDecelerating, now: float) -> Outcome:
    """Brake; a second ASS while one brakes is refused (C-HOST manual 2-12)."""
    if robot.braking is not None:
        raise Refused(Code.STOPPING)
    return robot.brake(now)
