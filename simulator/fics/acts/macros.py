"""Running a macro, step by step (C-HOST manual 1-7, 3)."""

from collections.abc import Mapping

from protocols.fics.macros import RunMacro
from protocols.fics.status import MotionMode
from simulator.fics.actions import Alarmed, Code, Refused, Task, action_of, plan_of, plans, understand
from simulator.fics.alarms import MESSAGE, system_error
from simulator.fics.macros import STEPS, Macro, filled_in, pause_of, taken_apart
from simulator.fics.robot import Robot


@plans(MotionMode.MACRO, RunMacro)
def _run_macro(robot: Robot, command: RunMacro, now: float) -> Task:
    values = dict(enumerate(command.arguments or [], start=1))
    return _steps(robot, robot.layout.macros[command.macro], values, now)


def _steps(robot: Robot, macro: Macro, values: Mapping[int, float | None], now: float) -> Task:
    """Do the steps; one that is refused ends it with message error 2nn, nn as in Enn: an assumption."""
    for number, step in enumerate(macro.steps, start=1):
        pause = pause_of(step)
        if pause is not None:
            now = yield now + pause
            continue
        try:
            task = _task(robot, filled_in(step, values), now)
        except Refused as refused:
            raise Alarmed(system_error(MESSAGE + refused.code, macro.program, number)) from None
        if task is not None:
            now = yield from task
    return now


def _task(robot: Robot, step: str, now: float) -> Task | None:
    """Do a step that is a command; what is left to wait for.

    :raises Refused: as if the host had sent it, or E10 for what no macro can do.
    """
    command = understand(*taken_apart(step))
    if not isinstance(command, STEPS):
        raise Refused(Code.IMPOSSIBLE)
    action = action_of(command)
    if action is None:
        _, plan = plan_of(command)
        return plan(robot, command, now)
    action(robot, command, now)
    return None
