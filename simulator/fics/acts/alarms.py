"""The actions of ERR, ERD and DRT (C-HOST manual 2-12 to 2-14)."""

from protocols.fics.alarms import CurrentError, ErrorDetail, GetErrorDetail, ResetErrors, TakeCurrentError
from simulator.fics.actions import Code, acts_out
from simulator.fics.robot import Robot


@acts_out(TakeCurrentError)
def _take_current_error(robot: Robot, command: TakeCurrentError, now: float) -> CurrentError:
    if robot.alarm is not None:
        return CurrentError(error=f"{robot.alarm.code:03d}")
    refusal, robot.refusal = robot.refusal, Code.NONE
    return CurrentError(error=f"E{refusal:02d}")


@acts_out(GetErrorDetail)
def _get_error_detail(robot: Robot, command: GetErrorDetail, now: float) -> ErrorDetail:
    return robot.latest


@acts_out(ResetErrors)
def _reset_errors(robot: Robot, command: ResetErrors, now: float) -> None:
    robot.reset()
