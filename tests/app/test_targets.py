"""Targets that a word on the command line can mean."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.exits import Failure
from app.targets import NamedTarget, numbered

IDS = st.from_regex("[a-z][a-z0-9-]{0,31}", fullmatch=True)


@given(IDS, st.integers(0x00, 0x9F), st.booleans())
def test_a_number_is_a_body_below_80_and_a_group_from_there_on(line: str, number: int, upper: bool) -> None:
    word = f"{line}.{number:02x}"
    target = numbered(word.upper() if upper else word)
    assert target == NamedTarget("groups" if number >= 0x80 else "bodies", f"{line}.{number:02X}")


@pytest.mark.parametrize("word", ["", "r1", "lift", "3", "3F0", "a.b.3F", "r1/units/1", "F3", ".3F", "٣F"])
def test_everything_else_has_no_number(word: str) -> None:
    assert numbered(word) is None


def test_a_robot_with_one_unit_needs_no_number_of_it() -> None:
    assert NamedTarget("robots", "r1", None, (3,)).unit_path() == "/robots/r1/units/3"
    assert NamedTarget("robots", "r1", 2, (1, 2)).unit_path() == "/robots/r1/units/2"
    with pytest.raises(Failure, match="several units"):
        NamedTarget("robots", "r1", None, (1, 2)).unit_path()
