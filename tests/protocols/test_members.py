"""Members of an enumeration at hand are plain attributes, and otherwise what they were."""

from enum import Enum, IntEnum, StrEnum
from typing import Any

import pytest

from protocols.members import at_hand


@at_hand
class Colour(Enum):
    """Compared by identity."""

    RED = "red"
    BLUE = "blue"


@at_hand
class Rank(IntEnum):
    """Numbers."""

    LOW = 1
    HIGH = 2


@at_hand
class Word(StrEnum):
    """Texts."""

    YES = "yes"
    NO = "no"


@pytest.mark.parametrize("kind", [Colour, Rank, Word])
def test_a_member_is_found_by_its_name_its_value_and_as_an_attribute(kind: type[Enum]) -> None:
    for name, member in kind.__members__.items():
        assert vars(kind)[name] is member is getattr(kind, name) is kind[name] is kind(member.value)
        assert member.name == name
    assert list(kind) == list(kind.__members__.values())


@pytest.mark.parametrize(("member", "equal"), [(Rank.HIGH, 2), (Word.NO, "no")])
def test_a_number_or_a_text_is_found_by_its_member(member: Any, equal: object) -> None:
    assert {equal: "found"}[member] == {member: "found"}[equal] == "found"


def test_a_member_that_is_neither_is_hashed_without_a_call() -> None:
    assert Colour.__hash__ is object.__hash__
    assert {Colour.RED: 1, Colour.BLUE: 2}[Colour("blue")] == 2
