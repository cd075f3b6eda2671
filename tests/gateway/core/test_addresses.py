"""Addresses are taken in any case and answered in one."""

import pytest

from gateway.core.addresses import MOST_LISTED, canonical_address, there_are
from gateway.core.errors import InvalidRequest
from gateway.core.parts import numbered_address


@pytest.mark.parametrize(
    ("text", "answered"),
    [
        ("3f", "3F"),
        ("ARM.3f", "arm.3F"),
        ("arm-2.9E", "arm-2.9E"),
        ("R1", "r1"),
        ("R1/Units/2", "r1/units/2"),
    ],
)
def test_an_address_is_answered_in_one_way_however_it_is_written(text: str, answered: str) -> None:
    assert canonical_address(text) == canonical_address(answered) == answered


@pytest.mark.parametrize("text", ["", "3", "3F0", ".3F", "arm.", "arm.r1", "r1/units", "3F/units/1", "３F"])
def test_what_is_no_address_is_refused(text: str) -> None:
    with pytest.raises(InvalidRequest, match="no address of a body or robot"):
        canonical_address(text)


@pytest.mark.parametrize(("text", "answered"), [("9e", "9E"), ("ARM.9e", "arm.9E"), ("nobody", "NOBODY")])
def test_the_address_of_a_body_or_group_may_be_of_nobody(text: str, answered: str) -> None:
    assert numbered_address(text) == answered


def test_what_there_is_is_listed_and_of_very_many_it_is_said_how_many_more() -> None:
    assert there_are([]) == "there are none"
    assert there_are(["3F"]) == "there is 3F"
    assert there_are(["00", "3F"]) == "there are 00, 3F"
    many = there_are([f"{number:02X}" for number in range(MOST_LISTED + 5)])
    assert many.endswith(", 1F, and 5 more")
