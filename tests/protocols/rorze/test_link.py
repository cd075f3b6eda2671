from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TypeVar

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocols.rorze.link import (
    MAX_REPLY_LENGTH,
    POISON,
    Answer,
    Frame,
    Garbage,
    GroupAnswer,
    LinkReader,
    MoveEnded,
    Refusal,
    Request,
    RequestReader,
    StatusChanged,
    UnknownMessage,
    encode,
    frame,
)
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from protocols.rorze.status import SetUserComment
from protocols.table import Spoken

T = TypeVar("T")


def read(data: bytes) -> list[Frame]:
    return LinkReader().feed(data)


def read_one(text: str) -> Frame:
    (found,) = read(text.encode() + b"\r")
    return found


# from the controllers


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (">&3F6PD+000050000", Answer(0x3F, "6PD", "+000050000")),
        (">&001+M", Answer(0, "1+M", "")),
        (">&775IS", Answer(0x77, "5IS", "")),
        (">&7FXID00,02,3F", Answer(0x7F, "XID", "00,02,3F")),
        (">$A6PD+000000001", Answer(0xA, "6PD", "+000000001")),
        (">#06PD+000000001", Answer(0, "6PD", "+000000001")),
        (">&3F1+M@50", Refusal(0x3F, "1+M", 0x50)),
        (">&3F1+M@", Refusal(0x3F, "1+M", None)),
        (">$31+M@5D", Refusal(3, "1+M", 0x5D)),
        (">&7FXVS@4A", Refusal(0x7F, "XVS", 0x4A)),
        (">&801+M@49", Refusal(0x80, "1+M", 0x49)),
        (">&9E1+M@", Refusal(0x9E, "1+M", None)),
        (">&7D1+M[3F:00]", MoveEnded(0x3F, "1+M", 0)),
        (">&7D00M[02:1F]", MoveEnded(2, "00M", 0x1F)),
        (">&7EXED[3F:C:H02]", StatusChanged(0x3F, {"C": 2})),
        (
            ">&7EXED[3F:M:H01,I:H03FF,P:-000000012]",
            StatusChanged(0x3F, {"M": 1, "I": 0x3FF, "P": -12}),
        ),
        (">&7EXED[3F:]", StatusChanged(0x3F, {})),
        (">&7CUSD[3F:hello]", UnknownMessage(0x7C, ">&7CUSD[3F:hello]")),
        (">&78ABC", UnknownMessage(0x78, ">&78ABC")),
        (">&9FABC", UnknownMessage(0x9F, ">&9FABC")),
        (">&FFABC", UnknownMessage(0xFF, ">&FFABC")),
    ],
)
def test_each_kind_of_frame_is_told_apart(text: str, found: Frame) -> None:
    assert read_one(text) == found


@pytest.mark.parametrize(
    ("text", "members"),
    [
        (">&80CED[00:12,1][01:13,1]", {0: Answer(0, "CED", "12,1"), 1: Answer(1, "CED", "13,1")}),
        (">&80CED@[00:@4A][01:13,1]", {0: Refusal(0, "CED", 0x4A), 1: Answer(1, "CED", "13,1")}),
        (">&801+M[00:][77:]", {0: Answer(0, "1+M", ""), 0x77: Answer(0x77, "1+M", "")}),
        (">&801+M@[00:@]", {0: Refusal(0, "1+M", None)}),
        (">&803ND[05:P[0025],+000000050]", {5: Answer(5, "3ND", "P[0025],+000000050")}),
    ],
)
def test_a_group_reply_is_taken_apart_into_its_members(
    text: str, members: dict[int, Answer | Refusal]
) -> None:
    found = read_one(text)
    assert isinstance(found, GroupAnswer)
    assert found == GroupAnswer(0x80, text[4:7], members)
    assert list(found.members) == list(members)


def test_members_whose_moves_end_together_share_a_frame() -> None:
    assert read(b">&7DHMM[00:00][01:02]\r") == [MoveEnded(0, "HMM", 0), MoveEnded(1, "HMM", 2)]


@pytest.mark.parametrize(
    "text",
    [
        "&3F6PD",
        ">3F6PD",
        ">&3f6PD",
        ">&3",
        ">&3F6P",
        ">$FF",
        ">&3F1+M@5",
        ">&3F1+M@5x",
        ">&3F1+M@505",
        ">&3F6PD\x7f",
        ">&3F6PD\x00+000000001",
        ">&80CED",
        ">&80CED12,1",
        ">&80CED[00:12,1]rest",
        ">&80CED[00:12,1][00:13,1]",
        ">&80CED[00:@4]",
        ">&80CED[88:1]",
        ">&80CED[00:1",
        ">&80CED@[00:@4A",
    ],
)
def test_what_is_no_frame_is_garbage_and_nothing_of_it_is_lost(text: str) -> None:
    (found,) = read(text.encode() + b"\r")
    assert isinstance(found, Garbage)
    assert found.data == text.encode()
    assert found.why


@pytest.mark.parametrize(
    "text",
    [
        ">&7D1+M",
        ">&7D1+M[3F:0]",
        ">&7D1+M[3F:00][02:xx]",
        ">&7EXED[3F:Q:H00]",
        ">&7EXED[3F:P:5]",
        ">&7EXEE[3F:C:H00]",
        ">&7E",
    ],
)
def test_a_malformed_message_from_a_special_address_is_still_told(text: str) -> None:
    if text == ">&7E":
        assert isinstance(read_one(text), Garbage)
    else:
        assert read_one(text) == UnknownMessage(int(text[2:4], 16), text)


@pytest.mark.parametrize("blank", [b"\r", b"\n\r", b"\r\r\r", b"\x00\r", b"\n"])
def test_stray_ends_of_line_are_nothing(blank: bytes) -> None:
    assert read(blank + b">&3F5IS\r" + blank) == [Answer(0x3F, "5IS", "")]


def test_noise_before_a_frame_does_not_hide_it() -> None:
    assert read(b"\xff\x80noise>&3F5IS\r") == [
        Garbage(b"\xff\x80noise", "something that is no reply"),
        Answer(0x3F, "5IS", ""),
    ]


def test_a_reply_that_lost_its_end_does_not_take_the_next_with_it() -> None:
    cut, whole = read(b">&3F6PD+0000>&025IS\r")
    assert cut == Garbage(b">&3F6PD+0000", "something that is no reply")
    assert whole == Answer(2, "5IS", "")


def test_an_echo_of_our_own_command_is_named() -> None:
    (echo,) = read(b"&3F6PD\r")
    assert isinstance(echo, Garbage)
    assert "echo" in echo.why


def test_a_line_without_end_is_told_once_and_takes_no_memory() -> None:
    reader = LinkReader()
    found = [frame for _ in range(100) for frame in reader.feed(b"\xa5" * 10_000)]
    assert len(found) == 1
    assert isinstance(found[0], Garbage)
    assert len(found[0].data) == MAX_REPLY_LENGTH + 1
    assert reader.pending() == 0
    assert reader.feed(b"tail\r>&3F5IS\r") == [Answer(0x3F, "5IS", "")]


def test_the_longest_reply_is_read_whole_and_nothing_longer_is() -> None:
    longest = b">&3F9VD" + b"x" * (MAX_REPLY_LENGTH - 7)
    assert read(longest + b"\r") == [Answer(0x3F, "9VD", "x" * (MAX_REPLY_LENGTH - 7))]
    assert all(isinstance(frame, Garbage) for frame in read(longest + b"x\r"))


def test_it_is_known_whether_a_frame_has_begun() -> None:
    reader = LinkReader()
    assert reader.pending() == 0
    reader.feed(b">&3F6PD")
    assert reader.pending() == 7
    reader.feed(b"+000000001\r")
    assert reader.pending() == 0


# any split


FRAMES = st.sampled_from(
    [
        b">&3F6PD+000050000\r",
        b">&3F1+M@50\r",
        b">&80CED@[00:@4A][01:13,1]\r",
        b">&7D1+M[3F:00]\r",
        b">&7EXED[3F:M:H01,I:H0000]\r",
        b">&7CUSD[3F:text]\r",
        b"&3F1+MA[3],500\r",
        b"$16PD\r",
        b"\r",
        b"\n",
        POISON,
        b"x" * (MAX_REPLY_LENGTH + 10),
    ]
)
STREAMS = st.lists(FRAMES | st.binary(max_size=12), max_size=8).map(b"".join)


def in_pieces(data: bytes, cuts: Sequence[int], feed: Callable[[bytes], list[T]]) -> list[T]:
    edges = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    return [found for start, end in pairwise(edges) for found in feed(data[start:end])]


@given(STREAMS, st.lists(st.integers(0, 10**6), max_size=12))
def test_how_replies_are_split_makes_no_difference(stream: bytes, cuts: list[int]) -> None:
    assert in_pieces(stream, cuts, LinkReader().feed) == LinkReader().feed(stream)


@given(STREAMS, st.lists(st.integers(0, 10**6), max_size=12))
def test_how_commands_are_split_makes_no_difference(stream: bytes, cuts: list[int]) -> None:
    assert in_pieces(stream, cuts, RequestReader().feed) == RequestReader().feed(stream)


@settings(max_examples=30)
@given(STREAMS)
def test_byte_by_byte_is_the_same(stream: bytes) -> None:
    assert in_pieces(stream, range(len(stream)), LinkReader().feed) == LinkReader().feed(stream)


@given(st.binary(max_size=200))
def test_after_any_noise_and_an_end_of_line_the_next_frame_is_read(noise: bytes) -> None:
    assert read(noise + b"\r>&3F5IS\r")[-1] == Answer(0x3F, "5IS", "")


@given(
    st.integers(0, 0x77),
    st.from_regex(r"[0-9A-Z]{3}", fullmatch=True),
    st.text("+-0123456789H,", max_size=30),
)
def test_whatever_a_body_answers_comes_back_whole(body: int, code: str, payload: str) -> None:
    assert read_one(f">&{body:02X}{code}{payload}") == Answer(body, code, payload)


@settings(max_examples=200)
@given(st.data())
def test_a_flipped_bit_gives_garbage_or_another_frame_and_never_a_crash(data: st.DataObject) -> None:
    good = bytearray(b">&80CED@[00:@4A][01:13,1]\r")
    place = data.draw(st.integers(0, len(good) - 1))
    good[place] ^= 1 << data.draw(st.integers(0, 7))
    assert LinkReader().feed(bytes(good) + b"\r")


# to the controllers


def test_a_command_becomes_a_frame() -> None:
    assert encode(0x3F, MoveClockwise(distance=500, pattern=3)) == b"&3F1+MA[3],500\r"
    assert encode(0x80, GetPosition()) == b"&806PD\r"
    assert encode(5, GetPosition(), "$") == b"$56PD\r"
    assert encode(5, GetPosition(), "#") == b"#56PD\r"


@pytest.mark.parametrize("body", [0x78, 0x7D, 0x7E, 0x9F, 0xFF, 0x100])
def test_an_address_that_does_not_exist_is_refused(body: int) -> None:
    with pytest.raises(ValueError, match="no address"):
        encode(body, GetPosition())


def test_a_body_with_two_digits_has_no_place_in_the_old_form() -> None:
    with pytest.raises(ValueError, match="cannot be addressed"):
        encode(0x10, GetPosition(), "$")


def test_sixty_characters_are_sent_and_sixty_one_are_not() -> None:
    assert frame(0, "x" * 58) == b"&00" + b"x" * 58 + b"\r"
    with pytest.raises(ValueError, match="61 characters"):
        frame(0, "x" * 59)


@pytest.mark.parametrize("text", ["1+M\r&005IS", "a\n", "&", "\x00", "é", "\t", "\x7f"])
def test_one_frame_never_becomes_two(text: str) -> None:
    with pytest.raises(ValueError, match="cannot be sent"):
        frame(0, text)


def test_the_poison_is_one_character_too_long_to_be_a_command() -> None:
    assert POISON == b"!" * 61 + b"\r"
    assert all(isinstance(request, Garbage) or request.too_long() for request in RequestReader().feed(POISON))


@pytest.mark.parametrize("cut", range(1, len("&3F1+MA[12],50000")))
def test_the_poison_makes_every_cut_command_too_long(cut: int) -> None:
    found = RequestReader().feed(b"&3F1+MA[12],50000"[:cut] + POISON)
    assert len(found) == 1
    assert all(isinstance(request, Garbage) or request.too_long() for request in found)


@pytest.mark.parametrize(
    ("data", "request_"),
    [
        (b"&3F6PD\r", Request("&", 0x3F, "6PD")),
        (b"$A6PD\r", Request("$", 0xA, "6PD")),
        (b"#06PD\r", Request("#", 0, "6PD")),
        (b"\n& 3F 1+M\tA[3], 500\r", Request("&", 0x3F, "1+MA[3],500")),
        (b"&3F\r", Request("&", 0x3F, "")),
        (b"&3F9VS2,Serial No.00000152\r", Request("&", 0x3F, "9VS2,Serial No.00000152")),
        (b"$19VS2,a b\r", Request("$", 1, "9VS2,a b")),
    ],
)
def test_the_link_master_reads_commands_without_their_blanks(data: bytes, request_: Request) -> None:
    assert RequestReader().feed(data) == [request_]


@pytest.mark.parametrize("data", [b"6PD\r", b"&3\r", b"&3f6PD\r", b">&3F6PD\r", b"&3F6PD\xff\r"])
def test_what_is_no_command_is_garbage(data: bytes) -> None:
    (found,) = RequestReader().feed(data)
    assert isinstance(found, Garbage)


def test_blanks_do_not_count_towards_the_length() -> None:
    (fits,) = RequestReader().feed(b"&00" + b" \t" * 40 + b"x" * 58 + b"\r")
    (too_long,) = RequestReader().feed(b"&00" + b"x" * 59 + b"\r")
    assert isinstance(fits, Request)
    assert isinstance(too_long, Request)
    assert (fits.too_long(), too_long.too_long()) == (False, True)


@given(st.integers(0, 0x77), st.text(st.characters(min_codepoint=0x21, max_codepoint=0x7E), max_size=45))
def test_what_one_side_encodes_the_other_side_reads(body: int, text: str) -> None:
    if "&" in text:
        with pytest.raises(ValueError, match="cannot be sent"):
            frame(body, text)
    else:
        assert RequestReader().feed(frame(body, text)) == [Request("&", body, text)]


def test_a_comment_keeps_its_inner_spaces_on_the_way() -> None:
    sent = encode(0x3F, SetUserComment(comment_number=2, text="Serial No.00000152"))
    assert RequestReader().feed(sent) == [Request("&", 0x3F, "9VS2,Serial No.00000152")]


def test_a_command_is_written_out_once_however_often_it_is_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    command = MoveClockwise(distance=500)
    frame = encode(1, command)
    monkeypatch.delattr(Spoken, "written")
    assert encode(1, command) == frame == b"&011+M500\r"
    with pytest.raises(AttributeError):
        encode(1, MoveClockwise(distance=500))
