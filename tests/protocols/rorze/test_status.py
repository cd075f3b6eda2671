import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from protocols.rorze import status
from protocols.table import RangeFault, Retry, SyntaxFault
from tests.protocols.rorze.examples import Row, check_examples

ROWS: list[Row] = [
    status.GetControllerStatus,
    status.ClearControllerStatus,
    status.GetEndCause,
    status.GetInformation,
    status.SetUserComment,
]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.code)
def test_the_manuals_examples(row: Row) -> None:
    check_examples(row)


def test_bits_have_names_from_the_lowest_up() -> None:
    assert status.names_of(0x01, status.CONTROLLER_STATUS_BITS) == ["pulses_running"]
    assert status.names_of(0xC2, status.CONTROLLER_STATUS_BITS) == [
        "limit_error",
        "stall_error",
        "communication_error",
    ]
    assert status.names_of(0x12, status.END_CAUSE_BITS) == ["cw_limit", "stop_command"]
    assert status.names_of(0x30, status.SENSOR_BITS) == ["in_position", "ems"]
    assert status.names_of(0x00, status.END_CAUSE_BITS) == []


def test_the_answer_has_the_form_that_was_asked_for() -> None:
    one, every = status.GetControllerStatus(bit=6), status.GetControllerStatus()
    assert one.read_reply("1").on == 1
    assert every.read_reply("H41").bits == 0x41
    with pytest.raises(SyntaxFault):
        one.read_reply("H41")
    with pytest.raises(SyntaxFault):
        every.read_reply("1")


def test_the_status_has_eight_bits() -> None:
    assert status.GetControllerStatus(bit=7).written() == "7"
    with pytest.raises(ValidationError):
        status.GetControllerStatus(bit=8)
    with pytest.raises(RangeFault):
        status.GetControllerStatus.read("8")
    for payload in ("H1", "H001", "Hff", "HG0", "2", "@"):
        with pytest.raises((SyntaxFault, RangeFault)):
            status.GetControllerStatus().read_reply(payload)


def test_the_end_cause_has_five_bits() -> None:
    assert status.GetEndCause().read_reply("H1F").bits == 0x1F
    with pytest.raises(RangeFault):
        status.GetEndCause().read_reply("H20")


def test_clearing_the_status_may_hide_an_alarm() -> None:
    assert status.ClearControllerStatus.retry is Retry.CONDITIONAL


def test_an_unset_comment_is_an_empty_text() -> None:
    assert status.GetInformation(comment_number=7).read_reply("").text == ""


@given(st.integers(1, 7), st.text(st.characters(min_codepoint=0x20, max_codepoint=0x7E), max_size=42))
def test_a_comment_is_refused_or_survives_the_wire(number: int, text: str) -> None:
    refused = len(text) > 40 or bool({">", "&"} & set(text)) or text.startswith("@") or text != text.strip()
    try:
        command = status.SetUserComment(comment_number=number, text=text)
    except ValidationError:
        assert refused
    else:
        assert not refused
        assert status.SetUserComment.read(command.written()) == command
        assert status.GetInformation(comment_number=number).read_reply(text).text == text


@pytest.mark.parametrize("text", ["a>b", "a&b", "@4A", " a", "a ", "a\r", "a\n", "a\tb", "é", "ｱ", "x" * 41])
def test_a_comment_that_would_not_survive_the_wire_is_refused(text: str) -> None:
    with pytest.raises(ValidationError):
        status.SetUserComment(comment_number=1, text=text)
    with pytest.raises(SyntaxFault):
        status.SetUserComment.read(f"1,{text}")


@pytest.mark.parametrize("number", [0, 8])
def test_there_are_seven_comments(number: int) -> None:
    with pytest.raises(ValidationError):
        status.GetInformation(comment_number=number)
    with pytest.raises(RangeFault):
        status.SetUserComment.read(f"{number},text")
