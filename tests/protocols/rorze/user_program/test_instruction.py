"""An instruction is read from its text, or refused at a character (RC-420 manual 15.2.3, 16)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.rorze.commands import COMMANDS
from protocols.rorze.user_program.instruction import (
    Communication,
    InstructionFault,
    Label,
    ProgramOperation,
    parse,
)
from protocols.rorze.user_program.operands import BankPlace, CompareSign, Constant, Offset, Register, ToLabel
from protocols.table import WireFault
from tests.protocols.rorze.user_program.examples import EXAMPLES, INSTRUCTIONS

PRINTED = """
    LDD1,10000 3PSP[0],D1 JMP*ST1 EAS0 1+M10000 JONMT,+0 END COSH0 00M SETOD0 JOFID0,+0 RSTOD0 1AM25000
    JOFMT,+3 JOFID6,+4 JMP-2 5IS *TEST 1AM5000 WAT5
    ADDD0,1000 ADDD0,D10 BSTD0,2,1 CAL*TEST SETM0 RET DIVD1,2 DIVD1,D5 EED CTSC1,0 INCC1 JCPD0>1000,*ST1
    JCPPP<0,+5 JER*Error JER6,*Stall SDCD0= JMG+0 SDDD0 JMP*STEP_1 JOFID3,*ST3 JOFT10,*Time_up JONM3,*Error1
    JONT2,-3 LDD12,HA0AAAAAA RSLD12 RSRD13 RSTM10 SDCERROR!! SDDC10 SETM100 SUBD0,1000 TMST0,100 JONID1,*ST1
    JONT0,-1 WAT30
"""
"""Every instruction that chapters 15 and 16 print."""


def refused(text: str) -> tuple[int, str]:
    with pytest.raises(InstructionFault) as caught:
        parse(text)
    return caught.value.at, caught.value.reason


@pytest.mark.parametrize("text", PRINTED.split())
def test_what_the_manual_prints_is_an_instruction(text: str) -> None:
    assert parse(text).text == text


@pytest.mark.parametrize("text", EXAMPLES)
def test_every_example_of_a_command_for_programs_is_an_instruction(text: str) -> None:
    instruction = parse(text)
    assert isinstance(instruction, Communication)
    assert instruction.command(lambda _: 0) == instruction.row.read(text[3:])


def test_an_instruction_is_taken_apart() -> None:
    compared = parse("JCPDIX>-5,*ST1")
    assert isinstance(compared, ProgramOperation)
    assert compared.operands == (BankPlace("D", "IX"), CompareSign(">"), Constant(-5), ToLabel("ST1"))
    polled = parse("JOFMT,+3")
    assert isinstance(polled, ProgramOperation)
    assert polled.operands == (Register("MT"), Offset(3))
    label = parse("*Stall")
    assert isinstance(label, Label)
    assert label.name == "Stall"


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("LDD1,10000", 3),
        ("LDD1,C4", 3),
        ("LDD1,RX", 3),
        ("LDD0,M3,7", 2),
        ("LDIX,10", 2),
        ("LDD1,IX", 2),
        ("JBTD0,3,1,*ST1", 4),
        ("1+M10000", 3),
        ("*ST1", 3),
    ],
)
def test_an_instruction_takes_its_steps(text: str, steps: int) -> None:
    assert parse(text).steps == steps


@pytest.mark.parametrize(
    ("text", "values", "sent"),
    [
        ("1+MA[D0],D1", {0: 3, 1: 500}, "1+MA[3],500"),
        ("3PSP[D0],D1", {0: 30, 1: 50_000}, "3PSP[30],50000"),
        ("3PSP[+],D1", {1: -5}, "3PSP[+],-5"),
        ("COSD0", {0: 0x3D}, "COSH003D"),
        ("COSD0,D1", {0: 1, 1: 1}, "COS1,1"),
        ("CESE,D0,D1", {0: 2, 1: 1}, "CESE,2,1"),
        ("CSSD0,D1,D2", {0: 8, 1: -50, 2: 50}, "CSS8,-50,50"),
        ("EASD0", {0: 0}, "EAS0"),
        ("PASD0", {0: 4}, "PAS4"),
        ("PBSD0", {0: 200}, "PBS200.00"),
        ("OADS[D0]", {0: 12}, "OADS[12]"),
    ],
)
def test_memories_stand_for_numbers_of_a_command(text: str, values: dict[int, int], sent: str) -> None:
    instruction = parse(text)
    assert isinstance(instruction, Communication)
    command = instruction.command(lambda memory: values[int(memory.place)])
    assert command.code + command.written() == sent


@pytest.mark.parametrize(
    ("text", "value"),
    [("1+MD0", 0), ("1+MA[D0],5", 30), ("COSD0", -1), ("COSD0", 0x10000), ("EASD0", 3), ("CSS8,D0,D0", 7)],
)
def test_a_memory_may_hold_what_no_command_can_take(text: str, value: int) -> None:
    instruction = parse(text)
    assert isinstance(instruction, Communication)
    with pytest.raises(WireFault):
        instruction.command(lambda _: value)


def test_hexadecimal_digits_are_no_memory() -> None:
    assert parse("COSHD0") == Communication("COSHD0", COMMANDS["COS"], ())


@pytest.mark.parametrize(
    ("text", "at", "reason"),
    [
        ("", 0, "'' is no command."),
        ("XYZ1", 0, "'XYZ' is no command."),
        ("jmp+0", 0, "'jmp' is no command. Commands are written in capitals."),
        ("ldD0,5", 0, "'ld' is no command. Commands are written in capitals."),
        ("xyz", 0, "'xyz' is no command."),
        ("WAIT5", 0, "'WAIT' is no command."),
        ("?!", 0, "'?!' is no command."),
        ("URG", 0, "URG cannot stand in a program."),
        ("HMM", 0, "HMM cannot stand in a program."),
        ("XID", 0, "XID cannot stand in a program."),
        ("JONMT", 5, "JON takes here: label (*NAME), distance +0 to +199 or -1 to -199."),
        ("SETD0", 3, "SET takes here: memory flag M0-M199, output OD0-OD15."),
        ("ENDX", 3, "END takes here: nothing more."),
        ("WAT1,2", 5, "WAT takes here: nothing more."),
        ("LDD200,1", 2, "D200 does not exist; the last data memory is D199."),
        ("JCPD0>D200,*A", 6, "D200 does not exist; the last data memory is D199."),
        ("1+MA[30],5", 3, "1+M cannot have these parameters: 'A[30],5': must be 29 or less, not 30."),
        ("1+MA[30],D5", 5, "1+M cannot take 30 for its pattern: must be 29 or less, not 30."),
        ("3PSP[D200],D1", 3, "D200 does not exist; the last data memory is D199."),
        ("SDCa&b", 4, "No instruction can have the character '&'."),
        ("1+M٣", 3, "No instruction can have the character '٣'."),
        ("*a-b", 2, "A label is * and 1 to 13 letters, digits and underscores, which '*a-b' is not."),
        (
            "*12345678901234",
            14,
            "A label is * and 1 to 13 letters, digits and underscores, which '*12345678901234' is not.",
        ),
        (
            "JCPD199>-999999999,*ABCDEFGHIJKLM",
            32,
            "The instruction has 33 characters, 32 are allowed.",
        ),
    ],
)
def test_a_fault_is_told_with_its_place(text: str, at: int, reason: str) -> None:
    assert refused(text) == (at, reason)


@given(INSTRUCTIONS)
def test_every_instruction_keeps_its_text(text: str) -> None:
    instruction = parse(text)
    assert instruction.text == text
    assert 1 <= instruction.steps <= 5


@given(st.text(max_size=40) | st.text("*+-<=>0123456789ACDEHIJMLNORSTXPYUWQ,[];", max_size=32))
def test_any_text_is_an_instruction_or_is_refused_at_a_character(text: str) -> None:
    try:
        read = parse(text)
    except InstructionFault as fault:
        at, reason = fault.at, fault.reason
    else:
        assert read.text == text
        return
    assert 0 <= at <= len(text)
    assert reason.endswith(".")
