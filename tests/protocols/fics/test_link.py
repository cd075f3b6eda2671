from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TypeVar

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocols.fics.alarms import GetErrorDetail, TakeCurrentError
from protocols.fics.jog import StartJog
from protocols.fics.link import (
    LONGEST_LINE,
    Completion,
    FicsRefusal,
    FicsRequest,
    FicsRequestReader,
    Frame,
    Garbage,
    QueryAnswer,
    SystemFailure,
    Terminator,
    Ver2Reader,
    Ver3Reader,
    credit,
    encode,
    frame,
)
from protocols.fics.moves import MoveAbsolute
from protocols.fics.speeds import GetAccelerationTimes, SetAccelerationTimes
from protocols.fics.status import AxisCoordinates, GetAxisStatus, GetUserPosition
from protocols.fics.stops import StopAllImmediately

T = TypeVar("T")


def ver2(text: str) -> list[Frame]:
    return Ver2Reader().feed(text.encode() + b"\r")


def ver3(text: str) -> list[Frame]:
    return Ver3Reader().feed(text.encode() + b"\r")


# what the robot says


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("LMA", Completion("LMA")),
        ("POE", Completion("POE")),
        ("PCK", Completion("PCK")),
        ("LMA E07", FicsRefusal("LMA", "E07")),
        ("VAO E05", FicsRefusal("VAO", "E05")),
        ("LMA 183", SystemFailure("LMA", "183")),
        ("ORG 201", SystemFailure("ORG", "201")),
        ("PCK 777", SystemFailure("PCK", "777")),
        ("ACD 183", SystemFailure("ACD", "183")),
        ("HMT 183", SystemFailure("HMT", "183")),
        ("APS 1.5,#####", QueryAnswer("APS", "1.5,#####")),
        ("MOD 3", QueryAnswer("MOD", "3")),
        ("IDI 12", QueryAnswer("IDI", "12")),
        ("ERR E05", QueryAnswer("ERR", "E05")),
        ("ERR 183", QueryAnswer("ERR", "183")),
        ("ERD ----", QueryAnswer("ERD", "----")),
        ("ERD  X21", QueryAnswer("ERD", " X21")),
    ],
)
def test_ver_3_tells_each_kind_of_frame_apart(text: str, found: Frame) -> None:
    assert ver3(text) == [found]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("APS 1.5,#####", QueryAnswer("APS", "1.5,#####")),
        ("ERR E05", QueryAnswer("ERR", "E05")),
        ("LMA E07", QueryAnswer("LMA", "E07")),
        ("POE", Completion("POE")),
    ],
)
def test_ver_2_has_answers_and_the_end_of_a_download_only(text: str, found: Frame) -> None:
    assert ver2(text) == [found]


@pytest.mark.parametrize(
    "text", ["AP", "aps 1", "APS1", "LMA\t", "LMA E07\x7f", "\xff", " LMA", "LMA,1", "APS 1\x00,2"]
)
@pytest.mark.parametrize("reader", [ver2, ver3])
def test_what_is_no_line_is_garbage_and_nothing_of_it_is_lost(
    text: str, reader: Callable[[str], list[Frame]]
) -> None:
    (found,) = reader(text)
    assert isinstance(found, Garbage)
    assert found.data == text.encode()
    assert found.why


@pytest.mark.parametrize("blank", [b"\r", b"\n\r", b"\r\n\r\n", b"\x00\r", b"\n"])
def test_stray_ends_of_line_and_padding_are_nothing(blank: bytes) -> None:
    assert Ver3Reader().feed(blank + b"LMA\r" + blank) == [Completion("LMA")]


def test_lines_may_end_with_cr_or_crlf() -> None:
    assert Ver3Reader().feed(b"LMA\r\nAPS 5\r\n") == [Completion("LMA"), QueryAnswer("APS", "5")]


def test_a_line_without_end_is_told_once_and_takes_no_memory() -> None:
    reader = Ver3Reader()
    found = [frame for _ in range(100) for frame in reader.feed(b"\xa5" * 10_000)]
    assert len(found) == 1
    assert isinstance(found[0], Garbage)
    assert "too long" in found[0].why
    assert len(found[0].data) == LONGEST_LINE + 1
    assert reader.pending() == 0
    assert reader.feed(b"tail\rLMA\r") == [Completion("LMA")]


def test_it_is_known_whether_a_line_has_begun() -> None:
    reader = Ver2Reader()
    reader.feed(b"APS 1")
    assert reader.pending() == 5
    reader.feed(b"\r")
    assert reader.pending() == 0


# whose it is


def test_a_query_is_answered_while_a_move_runs_and_each_gets_its_own() -> None:
    move, query = MoveAbsolute(coordinates=[100]), GetUserPosition()
    position, end = ver3("APS 50\rLMA")
    assert credit(query, position) == AxisCoordinates(coordinates=[50])
    assert credit(move, position) is None
    assert credit(move, end) == Completion("LMA")
    assert credit(query, end) is None


def test_a_stop_and_the_move_it_stopped_are_told_apart_by_name() -> None:
    move, stop = MoveAbsolute(coordinates=[100]), StopAllImmediately()
    stopped, ended = ver3("AES\rLMA 010")
    assert (credit(stop, stopped), credit(move, stopped)) == (Completion("AES"), None)
    assert (credit(stop, ended), credit(move, ended)) == (None, SystemFailure("LMA", "010"))


def test_refusals_belong_to_the_command_they_name() -> None:
    (refusal,) = ver3("JOG E01")
    assert credit(StartJog(axis="X", direction="+"), refusal) == FicsRefusal("JOG", "E01")
    assert credit(MoveAbsolute(coordinates=[1]), refusal) is None


def test_three_digits_are_a_time_to_who_asked_for_it_and_an_error_to_who_set_it() -> None:
    (found,) = ver3("VST 100")
    asked = credit(GetAccelerationTimes(), found)
    assert asked == GetAccelerationTimes().read_reply("100")
    assert credit(SetAccelerationTimes(times_ms=[100]), found) == SystemFailure("VST", "100")


def test_an_error_is_an_answer_to_who_asked_for_errors() -> None:
    (found,) = ver3("ERR E05")
    reply = credit(TakeCurrentError(), found)
    assert reply == TakeCurrentError().read_reply("E05")
    assert credit(GetErrorDetail(), found) is None


def test_an_answer_that_is_not_in_the_querys_form_is_not_for_it() -> None:
    (found,) = ver3("ACD 27001")
    assert credit(GetAxisStatus(), found) is None
    assert credit(MoveAbsolute(coordinates=[1]), QueryAnswer("LMA", "5")) is None
    assert credit(GetUserPosition(), Completion("APS")) is None


def test_noise_is_nobodys() -> None:
    assert credit(GetUserPosition(), Garbage(b"APS\x00", "not an answer")) is None


# what the host says


@pytest.mark.parametrize(
    ("line", "request_"),
    [
        (b"VAO 10,,30", FicsRequest("VAO", "10,,30")),
        (b"VAO10,,30", FicsRequest("VAO", "10,,30")),
        (b"VSO 300.0, 310.0, , 30", FicsRequest("VSO", "300.0,310.0,,30")),
        (b" APS ", FicsRequest("APS", "")),
        (b"\nAPS\x00\x00", FicsRequest("APS", "")),
        (b"JOG X+", FicsRequest("JOG", "X+")),
        (b"PCK 1", FicsRequest("PCK", "1")),
    ],
)
def test_the_blank_before_arguments_and_those_between_them_are_nothing(
    line: bytes, request_: FicsRequest
) -> None:
    assert FicsRequestReader().feed(line + b"\r") == [request_]


@pytest.mark.parametrize("line", [b"AP", b"aps", b"LMA\xff1", b"*", b"LMA 1\x07", b"A" * (LONGEST_LINE + 1)])
def test_what_cannot_be_a_command_is_garbage(line: bytes) -> None:
    (found,) = FicsRequestReader().feed(line + b"\r")
    assert isinstance(found, Garbage)
    assert found.data == line


@pytest.mark.parametrize(("terminator", "end"), [("cr", b"\r"), ("crlf", b"\r\n")])
def test_a_command_ends_as_the_line_is_set(terminator: Terminator, end: bytes) -> None:
    sent = encode(MoveAbsolute(coordinates=[10, None, -3.5]), terminator)
    assert sent == b"LMA 10,,-3.5" + end
    assert FicsRequestReader().feed(sent) == [FicsRequest("LMA", "10,,-3.5")]


@pytest.mark.parametrize("text", ["", "LM", "lma 1", "LMA 1\r", "LMA 1\rAES", "LMA\n", "LMA ä", "LMA \x00"])
def test_what_would_not_stay_one_frame_is_not_sent(text: str) -> None:
    with pytest.raises(ValueError, match="is no command"):
        frame(text)


def test_a_command_that_no_line_can_hold_is_not_sent() -> None:
    assert len(frame("LMA " + "1" * (LONGEST_LINE - 4))) == LONGEST_LINE + 1
    with pytest.raises(ValueError, match="512 are allowed"):
        frame("LMA " + "1" * (LONGEST_LINE - 3))


# any split


LINES = st.sampled_from(
    [
        b"APS 1.5,#####\r",
        b"LMA\r\n",
        b"LMA E07\r",
        b"ORG 201\r",
        b"POS 1,2\rPOE\r",
        b"VAO 10,,30\r",
        b"\r",
        b"\n",
        b"\x00\x00",
        b"X" * (LONGEST_LINE + 9),
    ]
)
STREAMS = st.lists(LINES | st.binary(max_size=12), max_size=8).map(b"".join)
CUTS = st.lists(st.integers(0, 10**6), max_size=12)


def in_pieces(data: bytes, cuts: Sequence[int], feed: Callable[[bytes], list[T]]) -> list[T]:
    edges = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    return [found for start, end in pairwise(edges) for found in feed(data[start:end])]


@given(STREAMS, CUTS)
def test_how_answers_are_split_makes_no_difference(stream: bytes, cuts: list[int]) -> None:
    assert in_pieces(stream, cuts, Ver2Reader().feed) == Ver2Reader().feed(stream)
    assert in_pieces(stream, cuts, Ver3Reader().feed) == Ver3Reader().feed(stream)


@given(STREAMS, CUTS)
def test_how_commands_are_split_makes_no_difference(stream: bytes, cuts: list[int]) -> None:
    assert in_pieces(stream, cuts, FicsRequestReader().feed) == FicsRequestReader().feed(stream)


@settings(max_examples=30)
@given(STREAMS)
def test_byte_by_byte_is_the_same(stream: bytes) -> None:
    assert in_pieces(stream, range(len(stream)), Ver3Reader().feed) == Ver3Reader().feed(stream)


@given(st.binary(max_size=200))
def test_after_any_noise_and_an_end_of_line_the_next_line_is_read(noise: bytes) -> None:
    assert Ver3Reader().feed(noise + b"\rLMA\r")[-1] == Completion("LMA")


@given(st.binary(max_size=40))
def test_no_noise_is_credited_to_a_move(noise: bytes) -> None:
    move = MoveAbsolute(coordinates=[1])
    for found in Ver3Reader().feed(noise.replace(b"LMA", b"") + b"\r"):
        assert credit(move, found) is None


@pytest.mark.parametrize("bit", range(8 * len(b"LMA\r")))
def test_an_end_of_move_with_a_flipped_bit_is_not_credited(bit: int) -> None:
    line = bytearray(b"LMA\r")
    line[bit // 8] ^= 1 << bit % 8
    move = MoveAbsolute(coordinates=[1])
    assert not any(credit(move, found) for found in Ver3Reader().feed(bytes(line)))
