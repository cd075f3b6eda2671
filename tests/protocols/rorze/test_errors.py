import re
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.rorze.commands import COMMANDS
from protocols.rorze.errors import _ROWS, ERRORS, OWN_ERRORS, ErrorKind, ErrorRow, lookup

SYSTEM = {*range(0x10, 0x18), 0x48, 0x4E, 0x4F, 0x53, 0x68}
COMMUNICATION = {0x4B, 0x4D}
OWN = [(command, row) for command, rows in OWN_ERRORS.items() for row in rows.values()]
COMMAND = {0x23, *range(0x40, 0x69)} - SYSTEM - COMMUNICATION - {0x57, 0x58, 0x59, 0x60}

JAPANESE = re.compile(r"[\u3040-\u30ff\u4e00-\u9fff]")


def test_the_table_has_every_code_of_chapter_21_once_and_23h_of_chapter_12() -> None:
    assert set(ERRORS) == SYSTEM | COMMAND | COMMUNICATION
    assert max(Counter(row.code for row in _ROWS).values()) == 1


@pytest.mark.parametrize(
    ("kind", "codes"),
    [(ErrorKind.SYSTEM, SYSTEM), (ErrorKind.COMMAND, COMMAND), (ErrorKind.COMMUNICATION, COMMUNICATION)],
)
def test_each_code_is_of_the_kind_the_manual_gives_it(kind: ErrorKind, codes: set[int]) -> None:
    assert {code for code, row in ERRORS.items() if row.kind is kind} == codes


@pytest.mark.parametrize("row", [*ERRORS.values(), *(row for _, row in OWN)])
def test_each_error_says_what_happened_and_what_to_do_in_both_languages(row: ErrorRow) -> None:
    assert all(JAPANESE.search(text) for text in (row.ja, row.remedy_ja))
    assert not any(JAPANESE.search(text) for text in (row.en, row.remedy_en))
    assert all(text.endswith(".") and text[0].isupper() for text in (row.en, row.remedy_en))
    assert row.remedy_ja.endswith("ください。")


def test_no_two_command_errors_read_alike() -> None:
    rows = {row for row in (*ERRORS.values(), *(row for _, row in OWN)) if row.kind is not ErrorKind.SYSTEM}
    assert len({row.en for row in rows}) == len({row.ja for row in rows}) == len(rows)


@pytest.mark.parametrize(("command", "own"), OWN)
def test_a_commands_own_page_counts_more_than_chapter_21(command: str, own: ErrorRow) -> None:
    assert own.code in COMMANDS[command].errors
    assert lookup(own.code, command) is own
    assert lookup(own.code, "1+M") is ERRORS[own.code or 0] is lookup(own.code)


@pytest.mark.parametrize(
    ("command", "code", "remedy"),
    [
        ("0QM", 0x52, ("CLD", "DLS")),
        ("0QM", 0x55, ("CLD",)),
        ("UWS", 0x5B, ("UBD",)),
        ("UWD", 0x5B, ("UED",)),
        ("URG", 0x5B, ("UED",)),
    ],
)
def test_the_remedy_names_the_commands_that_help(command: str, code: int, remedy: tuple[str, ...]) -> None:
    row = lookup(code, command)
    assert all(name in row.remedy_en and name in row.remedy_ja for name in remedy)
    assert lookup(code).remedy_en != row.remedy_en


@pytest.mark.parametrize("command", ["", "01M"])
def test_a_detection_of_stall_that_is_not_set_up_may_be_off_or_have_no_interval(command: str) -> None:
    row = lookup(0x54, command)
    assert all(name in row.remedy_en and name in row.remedy_ja for name in ("QSS", "QIS"))


@given(st.integers(0, 0xFF))
def test_every_byte_is_explained_and_a_code_the_manual_lacks_says_so(code: int) -> None:
    row = lookup(code)
    assert row.code == code
    assert (row.kind is ErrorKind.UNKNOWN) == (code not in ERRORS)
    if code not in ERRORS:
        assert f"{code:02X}h" in row.en
        assert f"0x{code:02X}" in row.ja


def test_an_error_without_a_code_is_explained_too() -> None:
    row = lookup(None)
    assert (row.code, row.kind) == (None, ErrorKind.UNKNOWN)
    assert row.en == "The controller gave no error code."
