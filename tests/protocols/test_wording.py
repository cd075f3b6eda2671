"""Faults that pydantic finds, in plain words: each kind of its errors has a sentence of this project."""

from typing import Any, Literal, get_args

import pytest
from pydantic import AwareDatetime, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails
from pydantic_core.core_schema import ErrorType

from protocols.wording import MOST_SHOWN, as_given, expectation, sentence, shown, unknown

THEIR_WORDS = ("Input", "input", "Value error", "Field", "Extra", "valid", "Unable", "permitted", "instance")


def fault(kind: str, given: object = 5, **context: object) -> ErrorDetails:
    """An error as pydantic describes it, with words of its own."""
    return {
        "type": kind,
        "loc": ("x",),
        "msg": "Input should be a valid thing",
        "input": given,
        "ctx": context,
    }


@pytest.mark.parametrize("kind", list(get_args(ErrorType)))
def test_no_kind_of_error_is_told_in_the_librarys_words(kind: str) -> None:
    names = ("gt", "ge", "lt", "le", "multiple_of", "expected", "expected_tags", "min_length", "max_length")
    said = sentence(fault(kind, **dict.fromkeys(names, "1")))
    assert not any(words in said for words in THEIR_WORDS)
    assert said.startswith(("must ", "is ", "has "))


def test_an_error_of_our_own_keeps_its_words() -> None:
    own = fault("not_possible", 7) | {"msg": "must be one capital letter"}
    assert sentence(own) == "must be one capital letter, not 7"
    assert (
        sentence(fault("value_error", 7, error=ValueError("no step at all"))) == "no step at all (given: 7)"
    )
    assert sentence(fault("value_error", 7, error=ValueError("7 is a command"))) == "7 is a command"


@pytest.mark.parametrize(
    ("shape", "given", "said"),
    [
        (int, 5.5, "must be a whole number, not 5.5"),
        (int, True, "must be a whole number, not true"),
        (bool, None, "must be true or false, not null"),
        (str, 5, "must be text, not 5"),
        (list[int], "1,2", "must be an array, not '1,2'"),
        (dict[str, int], 5, "must be an object, not 5"),
        (int, {"a": 1}, "must be a whole number"),
        (Literal["cw", "ccw"], "up", "must be 'cw' or 'ccw', not 'up'"),
        (Literal["high", "low"], "hgih", "must be 'high' or 'low', not 'hgih' (did you mean 'high'?)"),
        (AwareDatetime, "yesterday", "must be a time such as 2026-01-31T12:00:00Z, not 'yesterday'"),
    ],
)
def test_what_is_expected_stands_beside_what_was_given(shape: Any, given: object, said: str) -> None:
    with pytest.raises(ValidationError) as failed:
        TypeAdapter(shape).validate_python(given, strict=True)
    assert sentence(failed.value.errors()[0]) == said


def test_numbers_are_written_without_a_point_where_they_have_no_fraction() -> None:
    assert expectation(fault("less_than", lt=1e9)) == "must be less than 1000000000"
    assert expectation(fault("greater_than", gt=0.1)) == "must be greater than 0.1"


def test_alternatives_are_joined_as_in_a_sentence() -> None:
    assert expectation(fault("union_tag_invalid", expected_tags="'a', 'b', 'c'")) == "must be 'a', 'b' or 'c'"
    assert expectation(fault("union_tag_invalid", expected_tags="'a'")) == "must be 'a'"


def test_words_of_the_caller_go_first() -> None:
    assert (
        expectation(fault("string_type"), {"string_type": "must be text in quotes"})
        == "must be text in quotes"
    )


@pytest.mark.parametrize("given", ["x" * 1000, "\x1b[2J\r\n" * 100, 10**999, -(10**999)])
def test_what_was_given_is_shown_shortly_and_can_be_printed(given: object) -> None:
    text = shown(given)
    assert text is not None
    assert text.isprintable()
    assert len(text) <= 4 * (MOST_SHOWN + 8)


def test_a_name_that_is_blank_is_quoted() -> None:
    assert (as_given("line1.3F"), as_given(" "), as_given("")) == ("line1.3F", "' '", "''")
    assert as_given("x" * 1000).endswith("...'")


def test_a_name_nobody_knows_is_told_with_the_one_that_was_meant() -> None:
    assert unknown("speeed", ["speed", "pattern"]) == "did you mean speed?"
    assert unknown("body", ["last", "bodies"]) == "did you mean bodies?"
    assert unknown("colour", ["speed", "pattern"]) == "known are speed, pattern"
    assert unknown("colour", []) == "it takes none"


def test_a_time_without_its_zone_is_told_so() -> None:
    assert expectation(fault("timezone_aware")).endswith("with its zone")
