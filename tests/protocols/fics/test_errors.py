import re

import pytest

from protocols.fics.errors import ERRORS, FicsErrorKind, lookup
from protocols.fics.row import BLOCK_ERRORS, UPLOAD_ERROR

# C-HOST manual 2-12.
COMMUNICATION = [*range(1, 13), 99]


def test_the_table_has_every_communication_error_of_the_manual() -> None:
    listed = {code for code, row in ERRORS.items() if row.kind is FicsErrorKind.COMMUNICATION}
    assert listed == {f"E{number:02d}" for number in COMMUNICATION}


def test_what_refusals_are_made_of_stands_in_the_table() -> None:
    assert {*BLOCK_ERRORS.values(), UPLOAD_ERROR} <= set(ERRORS)


@pytest.mark.parametrize("code", [*ERRORS, "E55", "201", "777"])
def test_every_error_says_what_it_is_and_what_to_do_in_both_languages(code: str) -> None:
    row = lookup(code)
    assert row.code == code
    for english in (row.en, row.remedy_en):
        assert english.isascii()
        assert english.endswith(".")
    for japanese in (row.ja, row.remedy_ja):
        assert re.search("[\u3040-\u30ff\u4e00-\u9fff]", japanese)


@pytest.mark.parametrize(
    ("code", "kind"),
    [
        ("E00", FicsErrorKind.NONE),
        ("000", FicsErrorKind.NONE),
        ("E07", FicsErrorKind.COMMUNICATION),
        ("E55", FicsErrorKind.UNKNOWN),
        ("183", FicsErrorKind.FICS),
        ("201", FicsErrorKind.FICS),
        ("777", FicsErrorKind.FICS),
    ],
)
def test_the_kind_of_an_error_shows_in_its_code(code: str, kind: FicsErrorKind) -> None:
    assert lookup(code).kind is kind


def test_an_error_of_a_program_is_told_from_the_systems_own() -> None:
    assert "program" in lookup("201").en
    assert "program" not in lookup("777").en


def test_too_much_data_means_too_many_values_or_too_many_positions_and_both_are_told() -> None:
    """C-HOST manual 2-12 does not say which."""
    row = lookup("E11")
    for told in (row.en, row.remedy_en):
        assert re.search("axes|axis", told)
        assert re.search("1999|numbers", told)
    for told in (row.ja, row.remedy_ja):
        assert "軸数" in told
        assert "1999番" in told
