"""Rows say what is said, and the packing codec how it stands in bytes."""

from typing import Annotated

import pytest
from pydantic import Field, ValidationError

from protocols.packed import Packed, Packing
from protocols.table import Command, RangeFault, Reply, SyntaxFault, WireFault


class Told(Reply):
    """Where it is."""

    codec = Packing()
    channel: Annotated[int, Packed("B")]
    place: Annotated[int, Field(ge=-1000), Packed("i")]


class Ask(Command[Told]):
    """Asks for it."""

    codec = Packing()
    echo = ("channel",)
    channel: Annotated[int, Packed("B")]


def test_fields_stand_one_behind_the_other_the_most_significant_byte_first() -> None:
    assert Ask(channel=7).packed() == b"\x07"
    assert Ask.unpack(b"\x07") == Ask(channel=7)
    assert Told(channel=7, place=-5).packed() == b"\x07\xff\xff\xff\xfb"
    assert Ask(channel=7).read_reply(b"\x07\xff\xff\xff\xfb") == Told(channel=7, place=-5)
    assert Ask.usage() == ["channel"]
    assert not Ask.may_be_empty()


def test_zeros_fill_up_a_frame() -> None:
    assert Ask(channel=7).read_reply(b"\x07\x00\x00\x00\x05\x00\x00") == Told(channel=7, place=5)


@pytest.mark.parametrize(
    ("data", "fault"),
    [
        (b"\x07", SyntaxFault),  # too short
        (b"\x07\x00\x00\x00\x05\x01", SyntaxFault),  # more than zeros behind
        (b"\x08\x00\x00\x00\x00", SyntaxFault),  # of another channel
        (b"\x07\x80\x00\x00\x00", RangeFault),
    ],
)
def test_bytes_that_are_no_reply_are_none(data: bytes, fault: type[WireFault]) -> None:
    with pytest.raises(fault):
        Ask(channel=7).read_reply(data)


def test_a_row_refuses_what_its_fields_refuse() -> None:
    with pytest.raises(ValidationError):
        Told(channel=7, place=-1001)
