"""Errors of the system are told as what the details say they are."""

import pytest

from protocols.fics.alarm_texts import row_of
from protocols.fics.alarms import ErrorDetail
from protocols.fics.errors import lookup

TOLD = [
    ("001", "----E  ", "state EMERGENCY", "非常停止"),
    (
        "002",
        " Z41 +",
        "driver of axis Z reports error 41h; its inputs +OV are on",
        "Z軸のドライバでエラー 41h",
    ),
    ("002", "2XFF", "driver of axis X of unit 2 is not ready", "ユニット2のX軸のドライバで準備未完了"),
    ("003", "2A C", "driver of axis A of unit 2 does not answer", "ユニット2のA軸のドライバと通信できません"),
    ("004", "-- T0120034", "took too long, at program 12, step 34", "プログラム 12、ステップ 34"),
    (
        "205",
        "-2050120034",
        "stopped with message error 205. It was at program 12, step 34",
        "エラー 205 で",
    ),
    ("183", "-183001002005", "It was at program 1, step 20. The conversion says 05", "エラー補助情報: 05"),
]


@pytest.mark.parametrize(("code", "detail", "en", "ja"), TOLD)
def test_details_tell_what_an_error_is(code: str, detail: str, en: str, ja: str) -> None:
    row = row_of(code, ErrorDetail.read(detail))
    assert row.code == code
    assert en in row.en
    assert ja in row.ja


@pytest.mark.parametrize("detail", [None, ErrorDetail.read("-2050120034"), ErrorDetail.read("???")])
def test_what_tells_of_another_error_or_of_none_changes_nothing(detail: ErrorDetail | None) -> None:
    assert row_of("183", detail) == lookup("183")
