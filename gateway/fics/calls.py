"""The calls that help where something is wrong with a robot, by what is wrong."""

from collections.abc import Mapping, Sequence
from typing import Final

from gateway.core.errors import GatewayError, calls_for
from gateway.core.next_calls import ACKNOWLEDGE, ALARMS, LINE_STATE, STOP, NextCall, get, post
from gateway.core.rights import Right

ROBOT: Final = get("{subject}", "robots.robot")
ERRORS: Final = get("{subject}/errors", "robots.errors")
RESET: Final = post("{subject}/errors/reset", Right.OPERATE, "robots.reset")
MOVE: Final = get("{subject}/units/{unit}/moves/{move_id}", "robots.move")
STATUS: Final = get("{subject}/units/{unit}/status", "robots.status")
HOME: Final = post("{subject}/units/{unit}/moves", Right.OPERATE, "robots.home", kind="home")
SETTINGS: Final = get("{subject}/units/{unit}/settings", "robots.settings")

_LOOK = (STATUS, ERRORS)
CALLS: Final[Mapping[str, Sequence[NextCall]]] = {
    "controller-refused": (ERRORS,),
    "robot-busy": (ROBOT, STOP),
    "error-stands": (ERRORS, RESET),
    "error-remains": (ERRORS, RESET),
    "robot-failed": (ERRORS, RESET),
    "power-cycled": (SETTINGS, ACKNOWLEDGE, HOME),
    "speeds-not-restored": (SETTINGS,),
    "not-homed": (HOME,),
    "position-unknown": _LOOK,
    "robot-offline": (LINE_STATE,),
    "line-down": (LINE_STATE,),
    "journal-unavailable": (ALARMS,),
    "no-reply": _LOOK,
    "garbled-reply": _LOOK,
    "not-executed": _LOOK,
    "move-failed": _LOOK,
    "cancelled": (STATUS,),
    "command-garbled": (LINE_STATE,),
}
"""The calls that help, by the kind of the error."""


def calls_for_robot(
    error: GatewayError, robot_id: str, line_id: str, unit: int | None = None
) -> Sequence[NextCall]:
    """The calls that help where something is wrong with a robot, or one of its units."""
    return calls_for(error, CALLS, subject=f"/robots/{robot_id}", line=line_id, unit=unit)
