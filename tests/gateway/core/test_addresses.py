"""Addresses are taken in any case and answered in one."""

import pytest

from gateway.core.addresses import canonical_address, numbered_address
from gateway.core.errors import InvalidRequest


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
