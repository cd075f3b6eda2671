"""However a stream is split, its lines are the same; one without an end costs no memory."""

from collections.abc import Iterable
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.lines import CR, Lines

LONGEST = 4
STREAMS = st.lists(st.sampled_from([b"a", b"b", b"\n", b"\x00", CR])).map(b"".join)


def lines_of(stream: bytes) -> list[bytes]:
    """Expected lines of a stream: those that end, and the beginnings of those that are too long."""
    *ended, begun = stream.split(CR)
    return [line[: LONGEST + 1] for line in ended] + ([begun[: LONGEST + 1]] if len(begun) > LONGEST else [])


def pieces(stream: bytes, cuts: Iterable[int]) -> list[bytes]:
    places = sorted({0, len(stream), *(cut % (len(stream) + 1) for cut in cuts)})
    return [stream[start:end] for start, end in pairwise(places)]


@given(STREAMS, st.lists(st.integers(0, 100)))
def test_any_split_gives_the_same_lines(stream: bytes, cuts: list[int]) -> None:
    lines = Lines(LONGEST)
    given = [line for piece in pieces(stream, cuts) for line in lines.feed(piece)]
    assert given == lines_of(stream)
    begun = stream.rpartition(CR)[2]
    assert lines.pending() == (len(begun) if len(begun) <= LONGEST else 0)


def test_a_line_is_given_with_its_end_and_not_before() -> None:
    lines = Lines(LONGEST)
    assert lines.feed(b"ab") == []
    assert lines.pending() == 2
    assert lines.feed(b"c\rd") == [b"abc"]
    assert lines.pending() == 1


def test_empty_lines_are_lines() -> None:
    assert Lines(LONGEST).feed(b"\r\ra\r") == [b"", b"", b"a"]


@pytest.mark.parametrize("split", [True, False])
def test_a_line_that_grows_too_long_is_given_at_once_cut_and_once(split: bool) -> None:
    lines = Lines(LONGEST)
    begun = pieces(b"abcdefg", range(7)) if split else [b"abcdefg"]
    assert [line for piece in begun for line in lines.feed(piece)] == [b"abcde"]
    assert lines.pending() == 0
    assert lines.feed(b"and its tail") == []
    assert lines.feed(b"\rab\r") == [b"ab"]


def test_the_longest_line_is_whole() -> None:
    lines = Lines(LONGEST)
    assert lines.feed(b"abcd") == []
    assert lines.feed(CR) == [b"abcd"]


def test_two_lines_in_a_row_may_be_too_long() -> None:
    lines = Lines(LONGEST)
    assert lines.feed(b"first, first") == [b"first"]
    assert lines.feed(b"\rsecond") == [b"secon"]
    assert lines.feed(b"\rc\r") == [b"c"]


def test_a_flood_without_an_end_is_not_kept() -> None:
    lines = Lines(LONGEST)
    for _ in range(100):
        lines.feed(b"\xa5" * 1000)
    assert lines._begun == b"\xa5" * (LONGEST + 1)
