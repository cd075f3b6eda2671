"""The operands of an instruction (RC-420 manual 15.2.5)."""

import pytest

from protocols.rorze.user_program.operands import (
    BIT,
    BITS,
    COUNT,
    DATA,
    INPUT,
    LABELLED,
    MESSAGE,
    NUMBER,
    PLACE,
    SENSOR,
    SWITCH,
    BankPlace,
    Constant,
    InHexadecimal,
    Message,
    Offset,
    Operand,
    OperandKind,
    OutOfRange,
    Register,
    ToLabel,
    memory_in,
)


@pytest.mark.parametrize(
    ("kind", "text", "operand"),
    [
        (DATA, "D199", BankPlace("D", 199)),
        (DATA, "DIX", BankPlace("D", "IX")),
        (INPUT, "IDIY", BankPlace("ID", "IY")),
        (SENSOR, "SN5", BankPlace("SN", 5)),
        (NUMBER, "-999999999", Constant(-999999999)),
        (NUMBER, "HFFFFFFFF", Constant(0xFFFFFFFF)),
        (BIT, "H1F", Constant(31)),
        (SWITCH, "MT", Register("MT")),
        (PLACE, "*Time_up", ToLabel("Time_up")),
        (PLACE, "+0", Offset(0)),
        (PLACE, "-199", Offset(-199)),
        (BITS, "HT3", InHexadecimal(BankPlace("T", 3))),
        (MESSAGE, "D0=", Message("D0=")),
    ],
)
def test_an_operand_is_read(kind: OperandKind, text: str, operand: Operand) -> None:
    assert kind.read(text) == operand


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        (DATA, "C1"),
        (DATA, "D"),
        (DATA, "D01"),
        (DATA, "D-1"),
        (DATA, "DRX"),
        (NUMBER, "H"),
        (NUMBER, "Hff"),
        (NUMBER, "1.5"),
        (COUNT, "H1"),
        (LABELLED, "+1"),
        (PLACE, "5"),
        (PLACE, "*a-b"),
        (BITS, "HM3"),
        (MESSAGE, ""),
    ],
)
def test_something_else_is_not(kind: OperandKind, text: str) -> None:
    assert kind.read(text) is None


@pytest.mark.parametrize(
    ("kind", "text", "why"),
    [
        (DATA, "D200", "D200 does not exist; the last data memory is D199"),
        (INPUT, "ID10", "ID10 does not exist; the last input is ID9"),
        (COUNT, "10000000", "10000000 is out of range: number 0 to 9999999"),
        (BIT, "H20", "H20 is out of range: number 0 to 31 or H0 to H1F"),
        (PLACE, "+200", "+200 is out of range: +0 to +199, -1 to -199"),
        (PLACE, "-0", "-0 is out of range: +0 to +199, -1 to -199"),
        (MESSAGE, "12345678901234567", "the message has 17 characters, 16 are allowed"),
    ],
)
def test_what_does_not_exist_is_told(kind: OperandKind, text: str, why: str) -> None:
    with pytest.raises(OutOfRange, match=f"^{why.replace('+', '[+]')}$"):
        kind.read(text)


def test_kinds_together_take_what_either_takes() -> None:
    either = DATA | SENSOR
    assert (either.read("D3"), either.read("SN3")) == (memory_in("D3"), memory_in("SN3"))
    assert either.read("M3") is None
    assert either.words == "data memory D0-D199, sensor SN0-SN5"
