"""The errors of C-HOST and of the Fics, with their meanings and remedies in Japanese and English."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Final


class FicsErrorKind(StrEnum):
    """Where an error comes from (C-HOST manual 2-12)."""

    COMMUNICATION = "communication"
    """A command was refused: `E` and two digits. Asking for it clears it."""
    FICS = "fics"
    """An error of the system: three digits. It stands until it is reset by DRT."""
    UNKNOWN = "unknown"
    """An error that is not in the manual."""
    NONE = "none"


@dataclass(frozen=True, slots=True)
class FicsErrorRow:
    """One error: the manual's text, its English, and one next step in both languages."""

    code: str
    """The error as it stands on the wire: `E05`, `183`."""
    kind: FicsErrorKind
    ja: str
    en: str
    remedy_ja: str
    remedy_en: str


def _communication(code: str, ja: str, en: str, remedy_ja: str, remedy_en: str) -> FicsErrorRow:
    return FicsErrorRow(code, FicsErrorKind.COMMUNICATION, ja, en, remedy_ja, remedy_en)


MESSAGE_ERRORS: Final = "2"
"""First digit of the errors that a program of the system raises itself (C-HOST manual 2-13)."""


def _nothing(code: str) -> FicsErrorRow:
    return FicsErrorRow(
        code,
        FicsErrorKind.NONE,
        "エラーはありません。",
        "Nothing is wrong.",
        "対処は不要です。",
        "Nothing needs to be done.",
    )


_ROWS = (
    _nothing("E00"),
    _nothing("000"),  # an assumption: the manual prints E00 only
    _communication(
        "E01",
        "駆動コマンドエラー (動作中に実行不可能なコマンドを受信した。)",
        "The command is not possible while the robot is operating.",
        "動作の完了を待つか、減速停止 (ASS) で停止させてから再度実行してください。",
        "Wait for the end of the motion or stop it (ASS), then send the command again.",
    ),
    _communication(
        "E02",
        "アラーム中に駆動コマンドを受信した。",
        "A motion command was refused because an alarm stands.",
        "エラーの詳細 (ERD) を確認し、原因を取り除いてからDRTで解除してください。",
        "Read the details (ERD), remove the cause, then reset the error with DRT.",
    ),
    _communication(
        "E03",
        "この状態ではコマンドは受け付けられない。",
        "The command is not taken in this state.",
        "ロボットターミナルでの編集や設定、ポジションデータ設定 (POF) を終了してください。",
        "End editing at the teaching terminal, or a begun upload of positions (POF 2).",
    ),
    _communication(
        "E04",
        "停止要求中に再度停止コマンドを発行した。",
        "A stop is already under way.",
        "軸ステータス (ACD) で停止の完了を確認してください。",
        "See from the axis status (ACD) that all axes have come to rest.",
    ),
    _communication(
        "E05",
        "データ範囲エラー (データが設定範囲を超えている。)",
        "A value is outside its range.",
        "設定範囲内の値に訂正してください。",
        "Correct the value; the range stands at the command.",
    ),
    _communication(
        "E06",
        "フォーマットエラー",
        "The command is not written correctly.",
        "コマンドの形式を確認してください。",
        "Correct the command as its page prescribes.",
    ),
    _communication(
        "E07",
        "移動指令値エラー (移動指令値がソフトリミットを超えている。)",
        "The target of the move is beyond a soft limit.",
        "移動先をソフトリミット (SLP, SLM) の範囲内にしてください。",
        "Choose a target within the soft limits (SLP, SLM).",
    ),
    _communication(
        "E08",
        "ポジションナンバーエラー (POF 1を送信せずにPOSを送信した。)",
        "A position was sent without beginning an upload.",
        "POF 1を送信してからポジションデータを送信してください。",
        "Begin the upload with POF 1, then send the positions.",
    ),
    _communication(
        "E09",
        "指定ポジションデータなし",
        "The position is not set.",
        "ポジション番号を確認するか、ポジションデータを設定してください。",
        "Name a position that is set, or upload this one.",
    ),
    _communication(
        "E10",
        "この命令は実行できない",
        "The command cannot be carried out.",
        "軸ステータス (ACD) とエラーの詳細 (ERD) を確認してください。",
        "Read the axis status (ACD) and the details of the error (ERD).",
    ),
    _communication(
        "E11",
        "POSコマンドのデータ件数が多すぎる (値の数が軸数を超えているか、番号が1999番を超えている。)",
        "POS has sent too much: a position has more values than the unit has axes, or a number beyond 1999.",
        "POF 2で設定を終了し、値の数をユニットの軸数以内に、番号を1999番までにしてください。",
        "End the upload with POF 2; give a value for each axis of the unit at most, and numbers up to 1999.",
    ),
    _communication(
        "E12",
        "指定マクロが存在しない",
        "There is no such macro.",
        "マクロ名を確認してください。",
        "Correct the name of the macro.",
    ),
    _communication(
        "E99",
        "通信異常",
        "The communication is disturbed.",
        "配線と通信設定を確認してから、再度送信してください。",
        "Check the wiring and the settings of the line before going on.",
    ),
    FicsErrorRow(
        "183",
        FicsErrorKind.FICS,
        "CK時エラー (座標変換時に発生したエラー)",
        "The conversion between user and motor coordinates failed.",
        "移動先が動作範囲内にあることを確認し、DRTで解除してください。",
        "See that the target can be reached, then reset the error with DRT.",
    ),
)

ERRORS: Final[Mapping[str, FicsErrorRow]] = MappingProxyType({row.code: row for row in _ROWS})
"""Errors that ERR can answer, as far as the manual names them (C-HOST manual 2-12, 2-13)."""


def lookup(code: str) -> FicsErrorRow:
    """Give the row of an error; one the manual does not name gets a row that says so."""
    return ERRORS.get(code) or _unnamed(code)


def _unnamed(code: str) -> FicsErrorRow:
    if not code.isdecimal():
        return FicsErrorRow(
            code,
            FicsErrorKind.UNKNOWN,
            f"取扱説明書にない通信エラーコードです ({code})。",
            f"The manual does not name communication error {code}.",
            "軸ステータス (ACD) とエラーの詳細 (ERD) を確認してください。",
            "Read the axis status (ACD) and the details of the error (ERD).",
        )
    ja, en = "Ficsのエラー", "The system reports error"
    if code.startswith(MESSAGE_ERRORS):
        ja, en = "プログラムのメッセージエラー", "A program of the system reports error"
    return FicsErrorRow(
        code,
        FicsErrorKind.FICS,
        f"{ja} {code} が発生しています。",
        f"{en} {code}.",
        "エラーの詳細 (ERD) を確認し、原因を取り除いてからDRTで解除してください。",
        "Read the details (ERD), remove the cause, then reset the error with DRT.",
    )
