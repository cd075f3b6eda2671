"""The error codes of the RC-420, with their meanings and remedies in Japanese and English."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Final


class ErrorKind(StrEnum):
    """Where an error comes from (RC-420 manual 21)."""

    SYSTEM = "system"
    COMMAND = "command"
    COMMUNICATION = "communication"
    UNKNOWN = "unknown"
    """An error that is not in the manual, or of a controller that is set to leave the code out."""


@dataclass(frozen=True, slots=True)
class ErrorRow:
    """One error: the manual's text, its English, and one next step in both languages."""

    code: int | None
    """00-FF hex; None when the reply carried no code (RC-420 manual 12)."""
    kind: ErrorKind
    ja: str
    en: str
    remedy_ja: str
    remedy_en: str


def _command(code: int, ja: str, en: str, remedy_ja: str, remedy_en: str) -> ErrorRow:
    return ErrorRow(code, ErrorKind.COMMAND, ja, en, remedy_ja, remedy_en)


def _communication(code: int, ja: str, en: str, remedy_ja: str, remedy_en: str) -> ErrorRow:
    return ErrorRow(code, ErrorKind.COMMUNICATION, ja, en, remedy_ja, remedy_en)


def _system(code: int) -> ErrorRow:
    return ErrorRow(
        code,
        ErrorKind.SYSTEM,
        "ハードウェアの不具合が考えられます。弊社までご相談ください。",
        "The controller's hardware is probably faulty.",
        "コントローラの使用を中止し、エラーコードを添えてRORZE社へご相談ください。",
        "Take the controller out of use and contact RORZE with this code.",
    )


_SYSTEM = (*range(0x10, 0x18), 0x48, 0x4E, 0x4F, 0x53, 0x68)

_SET_UP_STALL_DETECTION: Final = (
    "コマンドQSS1で脱調検出を有効にし、コマンドQISで脱調検出間隔 (ドグの周期) を設定してください。",
    "Switch the STALL detection on with QSS1, and set its interval, the period of the dogs, with QIS.",
)
"""Either may be missing: the code is the same (RC-420 manual 13.6.2)."""

_ROWS = (
    *map(_system, _SYSTEM),
    # 23h stands in chapter 12 only; the table of chapter 21 leaves it out.
    _command(
        0x23,
        "コマンドの文字数が60文字を超えている。",
        "The command is longer than 60 characters.",
        "パラメータを短くするか、複数のコマンドに分けて送信してください。",
        "Shorten the parameters or split them over several commands.",
    ),
    _command(
        0x40,
        "起動速度 (OL) の値が設定されていない。",
        "The start speed (OL) is not set.",
        "コマンドOLSで起動速度を設定してください。",
        "Set the start speed of this speed parameter with OLS.",
    ),
    _command(
        0x41,
        "最大速度 (OH) の値が設定されていない。",
        "The maximum speed (OH) is not set.",
        "コマンドOHSで最大速度を設定してください。",
        "Set the maximum speed of this speed parameter with OHS.",
    ),
    _command(
        0x42,
        "最大加速度 (OS) の値が設定されていない。",
        "The maximum acceleration (OS) is not set.",
        "コマンドOSSで最大加速度を設定してください。",
        "Set the maximum acceleration of this speed parameter with OSS (letter O).",
    ),
    _command(
        0x43,
        "加速度増加区間率 (OA) の値が設定されていない。",
        "The share of increasing acceleration (OA) is not set.",
        "コマンドOASで加速度増加区間率を設定してください。",
        "Set the share of increasing acceleration of this speed parameter with OAS.",
    ),
    _command(
        0x44,
        "加速度減少区間率 (OB) の値が設定されていない。",
        "The share of decreasing acceleration (OB) is not set.",
        "コマンドOBSで加速度減少区間率を設定してください。",
        "Set the share of decreasing acceleration of this speed parameter with OBS (letter O).",
    ),
    _command(
        0x45,
        "起動速度 (OL) の値が、最大速度 (OH) より大きい。",
        "The start speed (OL) is above the maximum speed (OH).",
        "起動速度を最大速度以下に設定してください。",
        "Lower OL with OLS or raise OH with OHS.",
    ),
    _command(
        0x46,
        "加速度増加区間率 (OA) と加速度減少区間率 (OB) との合計が100[%]を越えている。",
        "The shares of increasing (OA) and decreasing (OB) acceleration add up to more than 100 %.",
        "OAとOBの合計が100[%]以下になるように設定してください。",
        "Lower OA with OAS or OB with OBS until they add up to 100 % or less.",
    ),
    _command(
        0x47,
        "加減速パターンが設定されていない。",
        "The acceleration pattern is not set.",
        "コマンドSPSで加減速パターンを設定するか、設定済みのパターンを指定してください。",
        "Set the pattern with SPS or name a pattern that is set.",
    ),
    _command(
        0x49,
        "コマンド・コードが正しくない。",
        "The command code is not known to the controller.",
        "コマンド・コードとコントローラのバージョン (9VD) を確認してください。",
        "Check the command code and the controller's version (9VD).",
    ),
    _command(
        0x4A,
        "コマンド・パラメータが正しくない。",
        "A command parameter is not written correctly.",
        "コマンドの書式を確認し、パラメータを訂正してください。",
        "Correct the parameter as the command's page prescribes.",
    ),
    _communication(
        0x4B,
        "RC-400から受信したコマンドがチェックサムエラー",
        "The command arrived from the RC-400 with a wrong checksum.",
        "RS-485の配線、終端抵抗、ノイズ対策を確認してください。",
        "Check the RS-485 wiring, its termination and nearby sources of noise.",
    ),
    _command(
        0x4C,
        "コマンドの実行中に、同一グループに属するコマンドを実行しようとした。",
        "A command of the same group is still being executed.",
        "実行中のコマンドの終了を待ってから、再度実行してください。",
        "Wait until the command under way has ended.",
    ),
    _communication(
        0x4D,
        "RS-485ポートの通信速度変更失敗した。",
        "The speed of the RS-485 port could not be changed.",
        "RS-485の配線を確認し、RC-400とコントローラの電源を再投入してください。",
        "Check the RS-485 wiring, then switch the RC-400 and the controller off and on.",
    ),
    _command(
        0x50,
        "モータ動作中に、モータ動作中実行不可のコマンドを実行した。",
        "The command is not allowed while the motor moves.",
        "移動の終了を待つか、モータを停止させてから実行してください。",
        "Wait for the end of the move or stop the motor first.",
    ),
    _command(
        0x51,
        "EMSセンサーがアクティブの状態、移動コマンドを実行しようとした。",
        "A move was refused because the EMS input is active.",
        "EMS入力の原因を取り除き、入力が解除されたことを確認してください。",
        "Remove the cause of the EMS input and see that it is released.",
    ),
    _command(
        0x52,
        "STALLエラーが発生している状態で、移動コマンドを実行しようとした。",
        "A move was refused because a STALL error stands: the motor has lost steps.",
        "原因を取り除き、原点サーチを実行するか、コマンドQRSまたはPRSで解除してください。",
        "Remove the cause, then search the origin, or clear the error with QRS or PRS.",
    ),
    _command(
        0x54,
        "脱調検出インターバルが設定されていない。",
        "The STALL detection is off, or its interval is not set.",
        *_SET_UP_STALL_DETECTION,
    ),
    _command(
        0x55,
        "CW、CCWリミットエラーが発生している状態で、移動コマンドを実行しようとした。",
        "A move was refused because a limit error stands.",
        "リミットセンサの状態を確認し、反対方向へ移動するか、原点サーチを実行してください。",
        "See which limit is active (CLD), then move away from it or search the origin.",
    ),
    _command(
        0x56,
        '停止中に、速度変更コマンド("5AS"、"5CS")を実行しようとした。',
        "The speed cannot be changed while the motor stands still.",
        "移動中に速度変更コマンドを実行してください。",
        "Change the speed (5AS, 5CS) while a move is under way.",
    ),
    _command(
        0x5A,
        "ユーザープログラムは、すでに実行中である。",
        "A user program is already running.",
        "ユーザープログラムの終了を待つか、コマンドUESで終了させてください。",
        "Wait for the user program to end or end it with UES.",
    ),
    _command(
        0x5B,
        "ユーザープログラムの指定アドレスが無い。",
        "The user program has no such address.",
        "コマンドUEDでプログラムの終わりを確認し、それより前のアドレスを指定してください。",
        "Read with UED where the program ends, and name an address before it.",
    ),
    _command(
        0x5C,
        '原点サーチ中に、速度変更コマンド("5AS"、"5CS")を実行しようとした。',
        "The speed cannot be changed during an origin search.",
        "原点サーチの終了を待ってください。",
        "Wait for the end of the origin search.",
    ),
    _command(
        0x5D,
        "コマンド・パラメータが有効範囲を越えている。",
        "A command parameter is out of range.",
        "パラメータを有効範囲内の値に訂正してください。",
        "Choose a value within the range of the command's page.",
    ),
    _command(
        0x5E,
        "移動量が10億パルスを超えている。",
        "The move is longer than 1,000,000,000 pulses.",
        "現在ポジションを確認し、移動量を小さくするか、複数の移動に分けてください。",
        "Read the position (6PD), then choose a shorter move or split it.",
    ),
    _command(
        0x5F,
        "定義されていないパラメータがあるため、コマンドを実行できない。",
        "A parameter that the command needs is not defined.",
        "コマンドが参照するパラメータを設定してから実行してください。",
        "Define every parameter that the command refers to, then try again.",
    ),
    _command(
        0x61,
        "コマンドを実行するために必要な設定が正しくなされていない。",
        "A setting that the command needs is missing or wrong.",
        "コマンドの必要設定の項目を確認し、設定してください。",
        "Make the settings that the command's page lists as required.",
    ),
    _command(
        0x62,
        "SESコマンドで設定されている減速開始速度が、減速区間の最大速度(OH)と異なる。",
        "The last speed set by SES differs from the maximum speed (OH) of the deceleration.",
        "SESの最後の速度を、減速区間の速度パラメータのOHと一致させてください。",
        "Make the last SES speed equal to OH of the pattern's deceleration.",
    ),
    _command(
        0x63,
        "同期補間時に、設定されている機械系のパラメータからは到達できない座標を指定した。",
        "The arm as it is set up cannot reach the coordinates of the interpolated move.",
        "アーム長などの機械系の設定を確認し、到達可能な座標を指定してください。",
        "Choose coordinates within reach, or correct the arm lengths (HAS, HFS).",
    ),
    _command(
        0x64,
        "補間パラメータの設定が正しくない。",
        "The interpolation is not set up correctly.",
        "補間パラメータ (HTS、HCS、HAS、HZS など) の設定を確認してください。",
        "Check the interpolation settings (HTS, HCS, HAS, HZS).",
    ),
    _command(
        0x65,
        '速度変更("SES")パラメータの設定が正しくない。',
        "The speed changes set by SES do not fit together.",
        "コマンドSEDで設定を確認し、SESで設定し直してください。",
        "Read the speed changes with SED and set them anew with SES.",
    ),
    _command(
        0x66,
        'エラー出力("CES")コマンドにより設定したエラーが発生した後、エラー出力状態を解除していない。',
        "An error has switched its error output (CES), and the output has not been released.",
        "エラーの原因を取り除き、コマンドCRSでエラー出力状態を解除してください。",
        "Remove the cause of the error, then release the output with CRS.",
    ),
    _command(
        0x67,
        "すでに設定されている部分に再度パラメータを設定しようとした。",
        "The place to be set is already taken by another setting.",
        "先に現在の設定を解除してから、設定してください。",
        "Clear the present setting first, or choose another place.",
    ),
)

ERRORS: Final[Mapping[int, ErrorRow]] = MappingProxyType(
    {row.code: row for row in _ROWS if row.code is not None}
)
"""Every error the manual names, by code (RC-420 manual 12 and 21)."""

_NO_ADDRESS = _command(
    0x5B,
    "ユーザープログラム未設定または、存在しないアドレスを指定した。",
    "There is no user program, or it has no such address.",
    "コマンドUEDでプログラムの終わりを確認し、存在するアドレスかラベルを指定してください。",
    "Read with UED where the program ends, and name an address or a label that it has.",
)

OWN_ERRORS: Final[Mapping[str, Mapping[int, ErrorRow]]] = MappingProxyType(
    {
        "0QM": {
            0x52: _command(
                0x52,
                "移動開始直前にSTALLセンサがONしていない。",
                "The STALL sensor is not on, so there is no dog to centre.",
                "コマンドCLDのビット0が1となる位置へ移動するか、コマンドDLSで論理を訂正してください。",
                "Move to where the STALL sensor is on (CLD bit 0), or correct its logic with DLS.",
            ),
            0x55: _command(
                0x55,
                "CW、CCWのセンサのいずれかがONしている。",
                "A limit sensor, CW or CCW, is on.",
                "コマンドCLDでリミットセンサの状態を確認し、反対方向へ移動してから実行してください。",
                "See which limit is on (CLD) and move away from it first.",
            ),
        },
        "01M": {
            0x54: _command(
                0x54,
                "脱調関連設定がされていない。",
                "The STALL detection is not set up: it is off, or has no interval.",
                *_SET_UP_STALL_DETECTION,
            )
        },
        "UWS": {
            0x5B: _command(
                0x5B,
                "ユーザープログラム領域を超えている。",
                "The user program's memory is full.",
                "コマンドUBDで残りステップ数を確認し、プログラムを短くしてください。",
                "Read the steps that are left with UBD, and shorten the program.",
            )
        },
        **{code: {0x5B: _NO_ADDRESS} for code in ("UPD", "URG", "USG", "UWD")},
    }
)
"""Errors that a command's own page explains otherwise than chapter 21: there the page counts."""


def lookup(code: int | None, command: str = "") -> ErrorRow:
    """Give the row of a code, in the meaning it has for the command, given by its three letters.

    A code the manual does not name, or none at all, gets a row that says so.
    """
    if code is None:
        return _unnamed(code, "エラーコードのないエラー応答です。", "The controller gave no error code.")
    return (
        OWN_ERRORS.get(command, {}).get(code)
        or ERRORS.get(code)
        or _unnamed(
            code,
            f"取扱説明書にないエラーコードです (0x{code:02X})。",
            f"The manual does not name error code {code:02X}h.",
        )
    )


def _unnamed(code: int | None, ja: str, en: str) -> ErrorRow:
    return ErrorRow(
        code,
        ErrorKind.UNKNOWN,
        ja,
        en,
        "コマンド9CDと9MDでコントローラの状態を確認してください。",
        "Read the controller's status (9CD) and end cause (9MD) before going on.",
    )
