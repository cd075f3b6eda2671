from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from transports.trace import NOBODY, Kind, TraceEntry, escape, unescape, wall_ns

AT_NS = 1_790_000_000_123_456_789


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"&3F1+MA[12],50000\r", r"&3F1+MA[12],50000\r"),
        (b">&3F6PD+000050000\r\n\t", r">&3F6PD+000050000\r\n\t"),
        (b"C:\\r", r"C:\\r"),
        (b"\x00\x7f\xff", r"\x00\x7f\xff"),
        (b"", ""),
    ],
)
def test_bytes_are_written_as_a_person_reads_them(data: bytes, text: str) -> None:
    assert escape(data) == text
    assert unescape(text) == data


@given(st.binary())
def test_escaped_bytes_are_printable_ascii_and_come_back_unchanged(data: bytes) -> None:
    text = escape(data)
    assert text.isascii()
    assert text.isprintable()
    assert unescape(text) == data


@given(st.text(alphabet="\\xrn09af&\r\xff"))
def test_each_data_has_one_text_and_no_other_is_read(text: str) -> None:
    try:
        data = unescape(text)
    except ValueError:
        return
    assert escape(data) == text


@pytest.mark.parametrize(
    "text", ["\r", "\\q", "\\", "\\u00e9", "\\N{BEL}", "é", "\\x0", "\\X00", "\\101", "\\x41"]
)
def test_foreign_escapes_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="printable ASCII"):
        unescape(text)


@given(st.binary(), st.sampled_from(["rx", "tx"]))
def test_an_entry_survives_json(data: bytes, kind: Kind) -> None:
    entry = TraceEntry.of((AT_NS, 5, kind, data, *NOBODY))
    assert TraceEntry.model_validate_json(entry.model_dump_json()) == entry


def test_an_entry_reads_as_one_line_of_json() -> None:
    entry = TraceEntry.of((AT_NS, 42, "rx", b">&3F1+M\r", *NOBODY))
    assert entry.model_dump_json() == (
        '{"at":"2026-09-21T14:13:20.123456Z","monotonic_ns":42,"kind":"rx","data":">&3F1+M\\\\r"}'
    )


def test_an_entry_of_another_kind_or_with_more_in_it_is_refused() -> None:
    with pytest.raises(ValidationError, match="kind"):
        TraceEntry.model_validate_json('{"at":"2026-11-21T03:00:00Z","monotonic_ns":5,"kind":"up"}')
    with pytest.raises(ValidationError, match="extra"):
        TraceEntry.model_validate_json(
            '{"at":"2026-11-21T03:00:00Z","monotonic_ns":5,"kind":"rx","body":"3F"}'
        )


def test_the_moment_of_an_entry_converts_back_to_its_microsecond() -> None:
    assert wall_ns(TraceEntry.of((AT_NS, 0, "rx", b"", *NOBODY)).at) == AT_NS // 1000 * 1000
    assert wall_ns(datetime(1970, 1, 1, tzinfo=UTC)) == 0
