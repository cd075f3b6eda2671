import re
from collections.abc import Iterator
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from transports.trace import (
    NOBODY,
    FrameSubject,
    Record,
    TraceEntry,
    TraceFilter,
    TraceKind,
    escape,
    unescape,
    wall_ns,
)

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
def test_an_entry_survives_json(data: bytes, kind: TraceKind) -> None:
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


GROUP = {0x80: (0x01, 0x3F)}


def subject_of(frame: bytes) -> FrameSubject:
    match = re.search(rb"&([0-9A-F]{2})", frame)
    if match is None:
        return FrameSubject(b"")
    number = int(match[1], 16)
    named = (int(found, 16) for found in re.findall(rb"\[([0-7][0-9A-F]):", frame))
    return FrameSubject(match[1], frozenset((number, *GROUP.get(number, ()), *named)))


def record(kind: TraceKind, data: str = "", request: str | None = None) -> Record:
    return (0, 0, kind, data.encode(), None, request)


STORY = [
    record("opened"),
    record("tx", "&3F6PD\r", "one"),
    record("rx", ">&3F6P"),
    record("rx", "D+000000001\r>&7E"),
    record("rx", "XED[01:M:H01]\r"),
    record("tx", "&016PD\r", "two"),
    record("rx", ">&016PD+000000002\r"),
    record("tx", "&809CD\r", "three"),
    record("rx", ">&809CD[01:H00][3F:H01]\r"),
    record("tx", "&3F9CD\r", "four"),
    record("rx", ">&3F9CDH00\r>&7D1+M[3F:00]\r"),
]


def passed(**wanted: object) -> list[str]:
    passing = TraceFilter(subject_of, **wanted)  # type: ignore[arg-type]  # as given by each story
    return [record[3].decode().replace("\r", "|") for record in passing.pass_on(STORY)]


def test_without_a_wish_all_pass() -> None:
    assert list(TraceFilter(subject_of).pass_on(STORY)) == STORY


def test_a_body_has_its_own_frames_its_groups_and_what_the_line_tells_of_it() -> None:
    assert passed(bodies={0x3F}) == [
        "",
        "&3F6PD|",
        ">&3F6P",
        "D+000000001|>&7E",
        "&809CD|",
        ">&809CD[01:H00][3F:H01]|",
        "&3F9CD|",
        ">&3F9CDH00|>&7D1+M[3F:00]|",
    ]
    assert passed(bodies={0x01}) == [
        "",
        "D+000000001|>&7E",
        "XED[01:M:H01]|",
        "&016PD|",
        ">&016PD+000000002|",
        "&809CD|",
        ">&809CD[01:H00][3F:H01]|",
    ]


@pytest.mark.parametrize(
    ("request_id", "records"),
    [
        ("one", ["&3F6PD|", ">&3F6P", "D+000000001|>&7E"]),
        ("two", ["&016PD|", ">&016PD+000000002|"]),
        ("three", ["&809CD|", ">&809CD[01:H00][3F:H01]|"]),
        ("four", ["&3F9CD|", ">&3F9CDH00|>&7D1+M[3F:00]|"]),
        ("five", []),
    ],
)
def test_a_request_has_what_it_sent_and_the_answers(request_id: str, records: list[str]) -> None:
    assert passed(request_id=request_id) == records


def test_both_wishes_hold_together() -> None:
    assert passed(request_id="three", bodies={0x01}) == ["&809CD|", ">&809CD[01:H00][3F:H01]|"]
    assert passed(request_id="one", bodies={0x01}) == []


def test_without_polls_the_gateways_own_questions_and_their_answers_are_left_out() -> None:
    def asked(data: str, caller: str) -> Record:
        return (0, 0, "tx", data.encode(), caller, None)

    story = [
        asked("&3F1+M500\r", "http 127.0.0.1"),
        record("rx", ">&3F1+M\r"),
        asked("&3F9CD\r", "gateway: poll"),
        record("rx", ">&3F9CDH01\r"),
        record("rx", ">&3F1+M[3F:00]\r"),
        asked("&013ND7\r", "gateway: fence"),
        record("rx", ">&013ND7\r"),
        asked("&3F5SS\r", "gateway: missing heartbeat"),
        record("rx", ">&3F5SS\r"),
        record("lost"),
    ]
    shown = list(TraceFilter(subject_of, without={"gateway: poll", "gateway: fence"}).pass_on(story))
    assert shown == [*story[:2], story[4], *story[7:]], "what stops a motor is shown, whoever asked"


@given(st.data())
def test_however_the_bytes_are_cut_every_byte_of_a_reply_passes(data: st.DataObject) -> None:
    reply = b">&3F6PD+000000001\r"

    def pieces() -> Iterator[Record]:
        rest = b">&016PD+000000002\r" + reply + b">&016PD+000000003\r"
        while rest:
            size = data.draw(st.integers(1, len(rest)))
            yield (0, 0, "rx", rest[:size], None, None)
            rest = rest[size:]

    heard = b"".join(record[3] for record in TraceFilter(subject_of, bodies={0x3F}).pass_on(pieces()))
    assert reply in heard


def test_noise_without_an_end_is_not_kept_for_ever() -> None:
    passing = TraceFilter(subject_of, bodies={0x3F})
    assert list(passing.pass_on([record("rx", "x" * 512)] * 100)) == []
    assert len(passing._pieces) < 10
