"""The table of the thirty commands of the user program (RC-420 manual 15.1, 20)."""

import pytest

from protocols.rorze.commands import COMMANDS
from protocols.rorze.user_program.operations import OPERATIONS

NAMED = """LD TMS CTS SET RST BST INC DEC ADD SUB MUL DIV AND OR JMP CAL RET JCP JMG JON JOF JBT JER EED WAT
    RSL RSR SDC SDD END"""
"""Operations in the order of 15.1."""

STEPS = {
    1: "INC DEC RET END EED",
    2: "SET RST WAT BST RSL RSR SDD",
    3: "TMS CTS AND OR JMP JON JOF CAL ADD SUB MUL DIV JER JMG SDC",
    4: "JBT",
    5: "JCP",
}
"""Operations by the number of steps in table 20; LD takes 3 or 2."""


def test_there_are_thirty() -> None:
    assert list(OPERATIONS) == NAMED.split()
    assert len(OPERATIONS) == 30


def test_none_is_mistaken_for_a_command() -> None:
    assert not [code for code in COMMANDS if code in OPERATIONS or code[:2] in OPERATIONS]


def test_each_takes_its_steps() -> None:
    for steps, codes in STEPS.items():
        for code in codes.split():
            assert {form.steps for form in OPERATIONS[code].forms} == {steps}, code
    assert {form.steps for form in OPERATIONS["LD"].forms} == {2, 3}


def test_what_jumps_is_marked() -> None:
    assert {code for code, row in OPERATIONS.items() if row.jumps} == {
        *("JMP", "JCP", "JMG", "JON", "JOF", "JBT", "JER")
    }


@pytest.mark.parametrize(
    ("code", "text", "words"),
    [
        ("END", "", []),
        ("LD", "D0,ID0,7", [(0, "D0"), (3, "ID0"), (7, "7")]),
        ("JCP", "D0>-5,*A", [(0, "D0"), (2, ">"), (3, "-5"), (6, "*A")]),
        ("JCP", "D0", [(0, "D0")]),
        ("SDC", "a,b", [(0, "a,b")]),
        ("JMP", ",", [(0, ""), (1, "")]),
    ],
)
def test_operands_are_told_apart(code: str, text: str, words: list[tuple[int, str]]) -> None:
    assert OPERATIONS[code].split(text) == words
