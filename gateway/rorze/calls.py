"""The calls that help where something is wrong with a body, by what is wrong."""

from collections.abc import Mapping, Sequence
from typing import Final

from gateway.core.errors import ControllerRefused, GatewayError, calls_for
from gateway.core.next_calls import ACKNOWLEDGE, ALARMS, LINE_STATE, STOP, NextCall, filled_in, get, post
from gateway.core.rights import RIGHT_OF, Right
from protocols.rorze.commands import BY_NAME

STATUS: Final = get(
    "{subject}/status", "Read its controller status.", "コントローラ・ステータスを読み出します。"
)
POSITION: Final = get("{subject}/position", "Read where it stands.", "現在位置を読み出します。")
MOVE: Final = get("{subject}/moves/{move_id}", "See the record of the move.", "移動の記録を確認します。")
MOVES: Final = get(
    "{subject}/moves", "See its moves, the newest first.", "新しい順に移動の記録を確認します。"
)
HOME: Final = post(
    "{subject}/moves", Right.OPERATE, "Search the origin.", "原点サーチを行います。", kind="home"
)
PROGRAM_RUN: Final = get(
    "{subject}/program/runs/current",
    "See the run of its user program.",
    "ユーザープログラムの実行状況を確認します。",
)
UPLOAD: Final = get(
    "{subject}/program/uploads/{upload_id}", "See the record of the upload.", "書き込みの記録を確認します。"
)
TABLE_UPLOAD: Final = get(
    "{subject}/positions/uploads/{upload_id}",
    "See the record of the upload.",
    "書き込みの記録を確認します。",
)
GROUP: Final = get("{subject}", "See the members of the group.", "グループの構成を確認します。")
SENSORS: Final = get("{subject}/sensors", "See which sensors are on.", "センサの状態を確認します。")
COMMANDS: Final = get("/commands", "See what each command takes.", "各コマンドの引数を確認します。")


def _command(name: str, en: str, ja: str) -> NextCall:
    return post(f"{{subject}}/commands/{name}", RIGHT_OF[BY_NAME[name].effect], en, ja)


CLEAR_STATUS: Final = _command(
    "clear-controller-status", "Clear its error status (9CS).", "エラーステータスをクリアします(9CS)。"
)
READ_COMMENT: Final = _command("get-information", "Read the comment (9VD).", "コメントを読み出します(9VD)。")
CLEAR_COMMENT: Final = _command("set-user-comment", "Set it to nothing (9VS).", "コメントを空にします(9VS)。")
CLEAR_ENCODER_STALL: Final = _command(
    "clear-encoder-stall-error", "Clear the encoder's STALL (PRS).", "エンコーダの脱調をクリアします(PRS)。"
)
CLEAR_STALL_SENSOR: Final = _command(
    "clear-stall-sensor-error", "Clear the sensor's STALL (QRS).", "STALLセンサの脱調をクリアします(QRS)。"
)
SET_START_SPEED: Final = _command(
    "set-start-speed", "Set the start speed (OLS).", "起動速度を設定します(OLS)。"
)
SET_MAXIMUM_SPEED: Final = _command(
    "set-maximum-speed", "Set the maximum speed (OHS).", "最高速度を設定します(OHS)。"
)
SET_RISING: Final = _command(
    "set-rising-acceleration-share",
    "Set the share of rising acceleration (OAS).",
    "加速度増加の割合を設定します(OAS)。",
)
SET_FALLING: Final = _command(
    "set-falling-acceleration-share",
    "Set the share of falling acceleration (OBS).",
    "加速度減少の割合を設定します(OBS)。",
)
SET_INTERVAL: Final = _command(
    "set-stall-sensor-interval", "Set the period of the dogs (QIS).", "ドグの周期を設定します(QIS)。"
)
PROGRAM_END: Final = _command(
    "get-last-program-address",
    "Read where the program ends (UED).",
    "プログラムの最終アドレスを読み出します(UED)。",
)

_LOOK = (STATUS, POSITION)
CALLS: Final[Mapping[str, Sequence[NextCall]]] = {
    "0x40": (SET_START_SPEED,),
    "0x41": (SET_MAXIMUM_SPEED,),
    "0x42": (
        _command(
            "set-maximum-acceleration",
            "Set the maximum acceleration (OSS).",
            "最大加速度を設定します(OSS)。",
        ),
    ),
    "0x43": (SET_RISING,),
    "0x44": (SET_FALLING,),
    "0x45": (SET_START_SPEED, SET_MAXIMUM_SPEED),
    "0x46": (SET_RISING, SET_FALLING),
    "0x47": (_command("set-pattern", "Set the pattern (SPS).", "加減速パターンを設定します(SPS)。"),),
    "0x4A": (COMMANDS,),
    "0x4C": (MOVES, STOP),
    "0x50": (MOVES, STOP),
    "0x51": (STATUS, CLEAR_STATUS),
    "0x52": (CLEAR_STALL_SENSOR, CLEAR_ENCODER_STALL, HOME),
    "0x54": (
        _command(
            "set-stall-sensor-detection",
            "Switch the STALL detection on (QSS).",
            "脱調検出を有効にします(QSS)。",
        ),
        SET_INTERVAL,
    ),
    "0x55": (STATUS, CLEAR_STATUS, HOME),
    "0x5A": (PROGRAM_RUN, STOP),
    "0x5B": (PROGRAM_END,),
    "0x5D": (COMMANDS,),
    "0x66": (
        _command(
            "clear-error-output-status", "Release the error output (CRS).", "エラー出力を解除します(CRS)。"
        ),
    ),
    "controller-refused": (STATUS,),
    "power-cycled": (STATUS, HOME, ACKNOWLEDGE),
    "body-busy": (MOVES, STOP),
    "body-offline": (LINE_STATE, STOP),
    "line-down": (LINE_STATE,),
    "journal-unavailable": (ALARMS,),
    "no-reply": _LOOK,
    "garbled-reply": _LOOK,
    "not-executed": _LOOK,
    "move-failed": _LOOK,
    "cancelled": _LOOK,
    "command-garbled": (LINE_STATE,),
}
"""By the controller's error code (RC-420 manual 21) or the kind of the error; what only the sender can know
is left out of the calls."""
OWN_CALLS: Final[Mapping[tuple[str, str], Sequence[NextCall]]] = {
    ("0QM", "0x52"): (
        SENSORS,
        _command(
            "set-sensor-logic", "Correct the sensor's logic (DLS).", "センサ入力論理を訂正します(DLS)。"
        ),
    ),
    ("0QM", "0x55"): (SENSORS,),
    ("UWS", "0x5B"): (
        _command(
            "get-free-program-steps",
            "Read the steps that are left (UBD).",
            "残りステップ数を読み出します(UBD)。",
        ),
    ),
}
"""By command and code, where the command's own page gives the code another meaning (RC-420 manual 14)."""
CALLS_OF_GROUPS: Final[Mapping[str, Sequence[NextCall]]] = {
    "body-busy": (GROUP, STOP),
    "line-down": (LINE_STATE,),
    "journal-unavailable": (ALARMS,),
}

CALLS_OF_LINES: Final[Mapping[str, Sequence[NextCall]]] = {
    "line-down": (LINE_STATE,),
    "body-busy": (LINE_STATE,),
    "controller-refused": (LINE_STATE,),
    "no-reply": (LINE_STATE,),
}


def calls_for_body(error: GatewayError, address: str) -> Sequence[NextCall]:
    """The calls that help where something is wrong with a body."""
    names = {"subject": f"/bodies/{address}", "line": address.partition(".")[0]}
    if isinstance(error, ControllerRefused) and not error.next:
        own = OWN_CALLS.get((error.command_code, error.error_code or ""))
        if own is not None:
            return filled_in(own, names)
    return calls_for(error, CALLS, **names)


def calls_for_group(error: GatewayError, address: str) -> Sequence[NextCall]:
    """The calls that help where something is wrong with a group."""
    return calls_for(error, CALLS_OF_GROUPS, subject=f"/groups/{address}", line=address.partition(".")[0])


def calls_for_line(error: GatewayError, line_id: str) -> Sequence[NextCall]:
    """The calls that help where something is wrong with a line."""
    return calls_for(error, CALLS_OF_LINES, line=line_id)
