"""The text of a backup: cut into parts and sections, or refused by its lines."""

import pytest

from gateway.core.backup_text import commented, parts_of, section
from gateway.core.errors import InvalidText

TEXT = (
    "; a comment\n\n[body 3F] ; the lift\n[ settings ]\nA\n\n ; B\n[program]\n[body 40]\n[settings]\nC ; D\n"
)


def test_a_text_has_parts_and_these_have_sections() -> None:
    one, other = parts_of(TEXT, "body")
    assert (one.name, one.line, list(one.sections)) == ("3F", 3, ["settings", "program"])
    assert [tuple(line) for line in one.sections["settings"]] == [(5, "A"), (6, ""), (7, " ; B")]
    assert other.sections == {"settings": [(11, "C ; D")]}


def test_all_faults_are_told_in_the_order_of_the_lines() -> None:
    with pytest.raises(
        InvalidText, match=r"Line 1, column 1: A heading .* There are 4 faults in all"
    ) as refusal:
        parts_of("lost\n[settings]\n[body 1]\n[body 2]\n[a]\n[a]\n", "body")
    assert [fault.line for fault in refusal.value.faults] == [1, 2, 3, 6]


def test_what_is_written_is_aligned() -> None:
    assert section("a", [commented("X", "one"), commented("Y" * 40, "two")]) == (
        f"\n[a]\n{'X':30}; one\n{'Y' * 40} ; two\n"
    )
