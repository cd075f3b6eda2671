"""The calls that help where something is wrong with a robot, by what is wrong."""

from collections.abc import Mapping, Sequence
from typing import Final

from gateway.core.errors import GatewayError, calls_for
from gateway.core.next_calls import ACKNOWLEDGE, ALARMS, LINE_STATE, STOP, NextCall, get, post
from gateway.core.rights import Right

ROBOT: Final = get("{subject}", "See the state of the robot.", "ロボットの状態を確認します。")
ERRORS: Final = get("{subject}/errors", "See which error stands.", "発生中のエラーを確認します。")
RESET: Final = post(
    "{subject}/errors/reset", Right.OPERATE, "Reset the error (DRT).", "エラーを解除します(DRT)。"
)
MOVE: Final = get(
    "{subject}/units/{unit}/moves/{move_id}", "See the record of the move.", "移動の記録を確認します。"
)
STATUS: Final = get("{subject}/units/{unit}/status", "Ask how its axes are.", "軸の状態を読み出します。")
HOME: Final = post(
    "{subject}/units/{unit}/moves", Right.OPERATE, "Home it.", "原点復帰を行います。", kind="home"
)
SETTINGS: Final = get("{subject}/units/{unit}/settings", "Read its speeds.", "速度の設定を読み出します。")

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
"""By the kind of the error."""


def calls_for_robot(
    error: GatewayError, robot_id: str, line_id: str, unit: int | None = None
) -> Sequence[NextCall]:
    """The calls that help where something is wrong with a robot, or one of its units."""
    return calls_for(error, CALLS, subject=f"/robots/{robot_id}", line=line_id, unit=unit)
