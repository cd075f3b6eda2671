import string
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from protocols.rorze import programs
from protocols.rorze.programs import (
    AddProgramInstruction,
    EndProgram,
    GetProgramInstruction,
    GetProgramLine,
    GetProgramMemory,
    RunProgram,
    SetProgramMemory,
)
from protocols.rorze.row import MAX_COMMAND_LENGTH, RorzeCommand
from protocols.table import RangeFault, Retry, SyntaxFault
from tests.protocols.rorze.examples import check_examples

ROWS: list[type[RorzeCommand[Any]]] = [
    programs.GetProgramAutostart,
    programs.SetProgramAutostart,
    programs.GetFreeProgramSteps,
    programs.ClearProgram,
    GetProgramMemory,
    SetProgramMemory,
    programs.GetLastProgramAddress,
    EndProgram,
    programs.GetProgramAddress,
    GetProgramLine,
    programs.GetProgramStatus,
    RunProgram,
    programs.StepProgram,
    GetProgramInstruction,
    AddProgramInstruction,
]

LABELS = st.text(string.ascii_letters + string.digits + "_", min_size=1, max_size=13)
MEMORIES = (
    st.integers(0, 199).map(lambda n: f"D{n}")
    | st.integers(0, 29).map(lambda n: f"C{n}")
    | st.integers(0, 29).map(lambda n: f"T{n}")
)


@pytest.mark.parametrize("row", ROWS)
def test_the_manuals_examples(row: type[RorzeCommand[Any]]) -> None:
    check_examples(row)


@pytest.mark.parametrize("row", ROWS)
def test_a_program_does_not_deal_with_programs(row: type[RorzeCommand[Any]]) -> None:
    assert not row.program
    assert row.moving == (row not in (programs.ClearProgram, AddProgramInstruction))


@pytest.mark.parametrize(
    ("row", "inside", "outside"),
    [
        (programs.SetProgramAutostart, "1", "2"),
        (GetProgramLine, "6038", "6039"),
        (RunProgram, "0", "-1"),
        (GetProgramMemory, "D199", "D200"),
        (GetProgramMemory, "C29", "C30"),
        (GetProgramMemory, "HT0", "HT30"),
        (SetProgramMemory, "D0,999999999", "D0,1000000000"),
        (SetProgramMemory, "D0,-999999999", "D0,-1000000000"),
        (SetProgramMemory, "C0,9999999", "C0,10000000"),
        (SetProgramMemory, "T0,0", "T0,-1"),
        (SetProgramMemory, "D0,H0", "C0,H0"),
    ],
)
def test_ranges(row: type[RorzeCommand[Any]], inside: str, outside: str) -> None:
    assert row.read(inside).written() == inside
    with pytest.raises(RangeFault):
        row.read(outside)


@pytest.mark.parametrize(
    ("row", "text"),
    [
        (SetProgramMemory, "D0,H100000000"),
        (SetProgramMemory, "D0"),
        (GetProgramMemory, "M0"),
        (GetProgramMemory, ""),
        (RunProgram, "*"),
        (RunProgram, "*ABCDEFGHIJKLMN"),
        (RunProgram, "*A-B"),
        (EndProgram, "2"),
        (AddProgramInstruction, ""),
        (AddProgramInstruction, "*ABCDEFGHIJKLMN"),
        (AddProgramInstruction, "SDC" + 30 * "X"),
        (AddProgramInstruction, "SDC&3F5SS"),
    ],
)
def test_what_has_no_such_form_is_refused(row: type[RorzeCommand[Any]], text: str) -> None:
    with pytest.raises(SyntaxFault):
        row.read(text)


def test_a_memory_answers_the_way_it_was_asked() -> None:
    decimal, bits = GetProgramMemory(memory="D0"), GetProgramMemory(memory="D0", notation="hexadecimal")
    assert decimal.read_reply("-000000001").value == -1
    assert bits.read_reply("HFFFFFFFF").bits == 0xFFFFFFFF
    with pytest.raises(SyntaxFault):
        decimal.read_reply("HFFFFFFFF")
    with pytest.raises(SyntaxFault):
        bits.read_reply("-000000001")


def test_a_counter_holds_no_bits_and_the_refusal_says_what_it_holds() -> None:
    with pytest.raises(ValidationError, match="a counter or timer holds a value of 0 to 9999999"):
        SetProgramMemory(memory="T3", bits=255)


@pytest.mark.parametrize(
    ("motor", "written"), [(None, ""), ("stop_immediately", "0"), ("stop_decelerating", "1")]
)
def test_ending_a_program_says_what_becomes_of_the_motor(motor: str | None, written: str) -> None:
    command = EndProgram.model_validate({"motor": motor})
    assert command.written() == written
    assert EndProgram.read(written) == command
    assert EndProgram.retry is Retry.STOP


def test_a_place_is_a_label_or_an_address_but_not_both() -> None:
    with pytest.raises(ValidationError, match="cannot be written"):
        RunProgram(label="ST1", address=125)


@pytest.mark.parametrize("label", ["*ST1", "", "ST 1", "ST1\n", "ラベル", "A" * 14])
def test_json_labels_are_plain_words(label: str) -> None:
    with pytest.raises(ValidationError):
        RunProgram(label=label)


@pytest.mark.parametrize("address", ["true", '"125"', "125.0"])
def test_json_addresses_are_whole_numbers(address: str) -> None:
    with pytest.raises(ValidationError):
        RunProgram.model_validate_json(f'{{"address": {address}}}')


def test_a_line_of_another_address_is_not_the_reply() -> None:
    with pytest.raises(SyntaxFault, match="asked was 512"):
        GetProgramLine(address=512).read_reply("00513,END")


def test_a_question_without_a_place_steps_on_and_is_not_repeated() -> None:
    for row in (GetProgramLine, GetProgramInstruction):
        assert row(label="ST1").may_repeat
        assert row(address=0).may_repeat
        assert not row().may_repeat


def test_an_empty_address_holds_no_instruction() -> None:
    assert GetProgramInstruction(address=6038).read_reply("").instruction is None
    assert GetProgramLine(address=6038).read_reply("06038,").instruction is None


@pytest.mark.parametrize(
    "instruction", ["JCPD0>1000,*ST1", "LDD1,10000", "*Time_up", "3*SP[25],50", "SDC" + 29 * "X"]
)
def test_instructions_of_the_manual_can_be_added_and_read_back(instruction: str) -> None:
    command = AddProgramInstruction(instruction=instruction)
    assert command.written() == instruction
    assert len(f"3FUWS{instruction}") <= MAX_COMMAND_LENGTH
    assert GetProgramInstruction().read_reply(instruction).instruction == instruction


@pytest.mark.parametrize("instruction", ["JON MT,+0", "END\r", "SDC$", "SDC#", "end", "ENDあ"])
def test_instructions_with_signs_that_would_not_arrive_are_refused(instruction: str) -> None:
    with pytest.raises(ValidationError):
        AddProgramInstruction(instruction=instruction)


@given(label=LABELS)
def test_a_label_reads_back(label: str) -> None:
    assert RunProgram.read(RunProgram(label=label).written()).label == label
    assert AddProgramInstruction(instruction=f"*{label}").written() == f"*{label}"


@given(memory=MEMORIES, value=st.integers(0, 9_999_999))
def test_a_memory_setting_reads_back(memory: str, value: int) -> None:
    command = SetProgramMemory(memory=memory, value=value)
    assert SetProgramMemory.read(command.written()) == command


@given(number=st.integers(0, 199), bits=st.integers(0, 0xFFFFFFFF))
def test_bits_of_a_data_memory_read_back(number: int, bits: int) -> None:
    command = SetProgramMemory(memory=f"D{number}", bits=bits)
    assert SetProgramMemory.read(command.written()) == command
    assert programs.MemoryReply(bits=bits).written() == f"H{bits:08X}"


@pytest.mark.parametrize(("row", "head"), [(GetProgramLine, "00511,"), (GetProgramInstruction, "")])
def test_the_reply_to_a_label_repeats_it_and_that_to_an_address_does_not(
    row: type[RorzeCommand[Any]], head: str
) -> None:
    asked = row.read("*TS")
    assert asked.read_reply(f"{head}*TS").written() == f"{head}*TS"
    for other in ("*TT", "END", ""):
        with pytest.raises(SyntaxFault):
            asked.read_reply(f"{head}{other}")
    assert row.read("511").read_reply(f"{head}*TS").written() == f"{head}*TS"
