"""Program texts become programs, or every fault is told; programs become texts (RC-420 manual 15.2)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.rorze.user_program.assembler import Assembled, ProgramFault, assemble, disassemble
from tests.protocols.rorze.user_program.examples import INSTRUCTIONS

EXAMPLE = """; example 2 of 15.2.7
*TEST
    SET OD0        ; the output shows that it runs
    1AM5000
    JON MT, +0\t; wait

    WAT 5
    RST OD0
    END
"""


def assembled(source: str) -> Assembled:
    program = assemble(source)
    assert isinstance(program, Assembled), program
    return program


def faults(source: str) -> list[tuple[int, int, str]]:
    found = assemble(source)
    assert not isinstance(found, Assembled)
    return [(fault.line, fault.column, fault.reason) for fault in found]


def test_a_text_becomes_a_program() -> None:
    program = assembled(EXAMPLE)
    assert program.texts() == ("*TEST", "SETOD0", "1AM5000", "JONMT,+0", "WAT5", "RSTOD0", "END")
    assert program.lines == (2, 3, 4, 5, 7, 8, 9)
    assert program.labels == {"TEST": 0}
    assert program.steps == 3 + 2 + 3 + 3 + 2 + 2 + 1


def test_a_program_becomes_a_text() -> None:
    program = assembled("*TEST\nJCPD0>-5,*TEST\nLDD0,ID0,7\nSDC a,b\nSDC;x\nCOSD0,D1\nEND")
    assert disassemble(program.instructions) == (
        "*TEST\nJCP D0>-5, *TEST\nLD D0, ID0, 7\nSDC a,b\nSDC;x\nCOSD0,D1\nEND\n"
    )


def test_nothing_becomes_an_empty_program() -> None:
    assert assembled(" \n;\n").texts() == ()


def test_lines_may_end_with_cr_lf() -> None:
    assert assembled("JMP +0\r\n\r\nEND\r\n").texts() == ("JMP+0", "END")


def test_a_message_may_have_a_semicolon() -> None:
    program = assembled("SDC a;b ; comment\nSDC x;\nEND;comment")
    assert program.texts() == ("SDCa;b", "SDCx;", "END")


def test_every_fault_is_told() -> None:
    source = """
        *TEST
        XYZ ; what is this
        JMP *NOWHERE
          JON   D5 , +0
        *TEST
        UES
        LD  D200, 1
        JMP +9
        JMP -9
        CAL *LAST
        *LAST"""
    assert faults(source) == [
        (3, 9, "'XYZ' is no command."),
        (4, 13, "There is no label *NOWHERE."),
        (5, 17, "JON takes here: memory flag M0-M199, input ID0-ID9, output OD0-OD15, sensor SN0-SN5, "
                "timer T0-T29, counter C0-C29, motor flag MT."),
        (6, 9, "The label *TEST is there already, on line 2."),
        (7, 9, "UES cannot stand in a program."),
        (8, 13, "D200 does not exist; the last data memory is D199."),
        (9, 13, "The jump leads to address 16, where nothing stands."),
        (10, 13, "The jump leads to address -1, where nothing stands."),
        (11, 13, "Nothing stands after the label *LAST."),
    ]  # fmt: skip


def test_a_fault_behind_the_last_character_has_the_next_column() -> None:
    assert faults(" JMP   ; where to") == [
        (1, 5, "JMP takes here: label (*NAME), distance +0 to +199 or -1 to -199.")
    ]


def test_the_room_is_limited() -> None:
    fits = "WAT 5\n" * 3019 + "END\n"
    assert assembled(fits).steps == 6039
    assert faults(fits + "\nEND\nEND") == [
        (3022, 1, "The program is too long from here: there is room for 6039 steps.")
    ]


def test_labels_are_limited() -> None:
    fits = "".join(f"*L{number}\n" for number in range(500))
    assert len(assembled(fits).labels) == 500
    assert faults(fits + "*L500\n*L501") == [(501, 1, "The program has too many labels: 500 are allowed.")]


@pytest.mark.parametrize("source", ["JMP *A, *B\n*A\nEND", "JON MT, *A,\nEND"])
def test_one_jump_has_one_target(source: str) -> None:
    assert [line for line, _, _ in faults(source)] == [1]


PROGRAMS = st.lists(INSTRUCTIONS, max_size=40)


@given(PROGRAMS)
def test_a_program_survives_its_text(program: list[str]) -> None:
    """An assembled program disassembles to a text that assembles to it; every other text has its faults."""
    result = assemble("\n".join(program))
    if isinstance(result, Assembled):
        assert result.texts() == tuple(program)
        again = assembled(disassemble(result.instructions))
        assert again.instructions == result.instructions
    else:
        assert result
        assert all(1 <= fault.line <= len(program) and fault.column >= 1 for fault in result)


@given(st.text(max_size=200) | st.text("*+-<=>0123456789ACDEHIJMLNORSTXPYUWQ,[]; \n\t\r", max_size=200))
def test_any_text_is_assembled_or_refused_with_places(source: str) -> None:
    result = assemble(source)
    if isinstance(result, Assembled):
        assert len(result.instructions) == len(result.lines)
        return
    lines = source.split("\n")
    for fault in result:
        assert isinstance(fault, ProgramFault)
        assert 1 <= fault.line <= len(lines)
        assert 1 <= fault.column <= len(lines[fault.line - 1]) + 1


@pytest.mark.parametrize("end", ["END", "JMP *L", "RET"])
def test_a_program_that_ends_so_needs_nothing_behind(end: str) -> None:
    assert assembled(f"*L\nSET OD0\n{end}").missing_end() is None


@pytest.mark.parametrize(
    ("source", "line"),
    [("SET OD0", 1), ("END\n*L", 2), ("1+M5 ; moves\n", 1), ("", 1)],
)
def test_a_program_that_goes_on_behind_its_last_instruction_misses_its_end(source: str, line: int) -> None:
    fault = assembled(source).missing_end()
    assert fault is not None
    assert (fault.line, "END" in fault.reason) == (line, True)
