"""System errors in words, from ERR and the details of ERD (C-HOST manual 2-12, 2-13)."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Final, NamedTuple

from protocols.fics.alarms import DetailKind, DriverSignals, ErrorDetail
from protocols.fics.errors import MESSAGE_ERRORS, FicsErrorRow, lookup
from protocols.fics.notation import driver_error_text

NOT_READY: Final = 0xFF
"""Driver code in the details of a driver that is not ready."""


class ErrorSentence(NamedTuple):
    """One error and the next step, in both languages."""

    ja: str
    en: str
    remedy_ja: str
    remedy_en: str


def row_of(code: str, detail: ErrorDetail | None) -> FicsErrorRow:
    """Give the row of an error that stands, worded by its details where they are of this error."""
    row = lookup(code)
    if detail is None or (detail.error is not None and detail.error != int(code)):
        return row
    word = _WORDS.get(detail.kind)
    return row if word is None else replace(row, **word(code, detail)._asdict())


def _emergency(_: str, __: ErrorDetail) -> ErrorSentence:
    return ErrorSentence(
        "非常停止状態です。",
        "The robot is in the state EMERGENCY: its stop input is on, or AES was received.",
        "非常停止入力を解除し、DRTで解除してください。",
        "Release the stop input, then reset the error with DRT.",
    )


def _driver(_: str, detail: ErrorDetail) -> ErrorSentence:
    code = detail.driver_error or 0
    told = driver_error_text(code)
    ja = f"準備未完了 ({told})" if code == NOT_READY else f"エラー {told}"
    en = f"is not ready ({told})" if code == NOT_READY else f"reports error {told}"
    inputs = _inputs(detail.signals)
    return ErrorSentence(
        f"{_axis_ja(detail)}のドライバで{ja}が発生しています。{f'入力: {inputs}。' if inputs else ''}",
        f"The driver of {_axis_en(detail)} {en}{f'; its inputs {inputs} are on' if inputs else ''}.",
        "ドライバの取扱説明書でエラーコードを確認し、原因を取り除いてからDRTで解除してください。",
        "Look the code up in the driver's manual, remove the cause, then reset the error with DRT.",
    )


def _inputs(signals: DriverSignals | None) -> str:
    if signals is None:
        return ""
    told = (("E", signals.emergency), ("+OV", signals.plus_overtravel), ("-OV", signals.minus_overtravel))
    return ", ".join(name for name, on in told if on)


def _connection(_: str, detail: ErrorDetail) -> ErrorSentence:
    return ErrorSentence(
        f"{_axis_ja(detail)}のドライバと通信できません。",
        f"The driver of {_axis_en(detail)} does not answer.",
        "ドライバの電源と配線を確認してからDRTで解除してください。",
        "Check the driver's power and wiring, then reset the error with DRT.",
    )


def _timeout(_: str, detail: ErrorDetail) -> ErrorSentence:
    return ErrorSentence(
        f"タイムアウトエラーです ({_where_ja(detail)})。",
        f"Something took too long, at {_where_en(detail)}.",
        "該当ステップの動作条件を確認してからDRTで解除してください。",
        "See what the step waits for, then reset the error with DRT.",
    )


def _fics(code: str, detail: ErrorDetail) -> ErrorSentence:
    row = lookup(code)
    ja, en = row.ja, row.en
    if code.startswith(MESSAGE_ERRORS):
        ja = f"プログラムがメッセージエラー {code} で停止しました。"
        en = f"A program has stopped with message error {code}."
    routine = "" if detail.routine_error is None else f" {detail.routine_error:02d}"
    said_ja = f" エラー補助情報:{routine}。" if routine else ""
    said_en = f" The conversion says{routine}." if routine else ""
    return ErrorSentence(
        f"{ja} ({_where_ja(detail)}){said_ja}",
        f"{en} It was at {_where_en(detail)}.{said_en}",
        row.remedy_ja,
        row.remedy_en,
    )


def _axis_ja(detail: ErrorDetail) -> str:
    return f"{f'ユニット{detail.unit}の' if detail.unit else ''}{detail.axis}軸"


def _axis_en(detail: ErrorDetail) -> str:
    return f"axis {detail.axis}{f' of unit {detail.unit}' if detail.unit else ''}"


def _where_ja(detail: ErrorDetail) -> str:
    return f"プログラム {detail.program}、ステップ {detail.step}"


def _where_en(detail: ErrorDetail) -> str:
    return f"program {detail.program}, step {detail.step}"


_WORDS: Final[Mapping[DetailKind, Callable[[str, ErrorDetail], ErrorSentence]]] = {
    DetailKind.EMERGENCY: _emergency,
    DetailKind.DRIVER: _driver,
    DetailKind.CONNECTION: _connection,
    DetailKind.TIMEOUT: _timeout,
    DetailKind.FICS: _fics,
}
