import re
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from protocols.rorze.notation import (
    BILLION,
    Bounds,
    Digits,
    Flag,
    Hex,
    Hundredths,
    Interval,
    Number,
    PaddedHundredths,
    Plain,
    PositionReference,
    PositionWire,
    Pulses,
    Signed,
    Slot,
    Speed,
    TwoDecimals,
    UpTo,
    Word,
)
from protocols.table import RangeFault, SyntaxFault, Wire

PULSES = st.integers(-BILLION + 1, BILLION - 1)


def fits(wire: Wire, text: str) -> bool:
    return re.fullmatch(wire.pattern, text) is not None


@pytest.mark.parametrize(
    ("wire", "value", "text"),
    [
        (Number(), 500, "500"),
        (Number(), -5, "-5"),
        (Digits(4), 25, "0025"),
        (Digits(1), 0, "0"),
        (Signed(), 50, "+000000050"),
        (Signed(), -999_999_999, "-999999999"),
        (Signed(), 0, "+000000000"),
        (Hex(2), 10, "H0A"),
        (Hex(4, least=1), 0x3FF, "H03FF"),
        (UpTo(2), 7, "7"),
        (Plain(), -12, "-12"),
        (Hundredths(), 2.0, "2.00"),
        (Hundredths(), 0.07, "0.07"),
        (PaddedHundredths(8), 200.0, "00200.00"),
        (Word(endless="Z", encoder="C"), "endless", "Z"),
        (PositionWire(), PositionReference(position=25), "P[25]"),
        (PositionWire(), PositionReference(position="next"), "P[+]"),
        (PositionWire(), PositionReference(position="previous"), "P[-]"),
    ],
)
def test_a_value_is_written_as_the_manual_prints_it_and_read_back(wire: Wire, value: Any, text: str) -> None:
    assert wire.encode(value) == text
    assert fits(wire, text)
    assert wire.decode(text) == value


@pytest.mark.parametrize(
    ("wire", "text", "value"),
    [
        (Number(), "+5", 5),
        (Number(), "H1F4", 500),
        (Number(), "0005", 5),
        (Hex(4, least=1), "H3", 3),
        (Plain(), "+12", 12),
        (Hundredths(), "2.5", 2.5),
        (PositionWire(), "P[0025]", PositionReference(position=25)),
    ],
)
def test_other_notations_of_the_same_value_are_read(wire: Wire, text: str, value: object) -> None:
    assert fits(wire, text)
    assert wire.decode(text) == value


@pytest.mark.parametrize(
    ("wire", "text"),
    [
        (Number(), ""),
        (Number(), " 5"),
        (Number(), "5 "),
        (Number(), "1_000"),
        (Number(), "5.0"),
        (Number(), "1e3"),
        (Number(), "0x5"),
        (Number(), "h1F"),
        (Number(), "H"),
        (Number(), "--5"),
        (Number(), "5\n"),
        (Number(), "9" * 13),
        (Digits(4), "25"),
        (Digits(4), "+0025"),
        (Digits(4), "00025"),
        (Signed(), "000000050"),
        (Signed(), "+50"),
        (Signed(), "+0000000050"),
        (Hex(2), "0A"),
        (Hex(2), "HA"),
        (Hex(2), "H0a"),
        (Hex(2), "H00A"),
        (UpTo(2), "123"),
        (UpTo(2), "-1"),
        (Hundredths(), "2"),
        (Hundredths(), "2."),
        (Hundredths(), "2.005"),
        (Hundredths(), "-2.00"),
        (PaddedHundredths(8), "200.00"),
        (PaddedHundredths(8), "00200.0"),
        (Word(endless="Z"), "z"),
        (Word(endless="Z"), "ZZ"),
        (PositionWire(), "P25"),
        (PositionWire(), "P[]"),
        (PositionWire(), "P[*]"),
        (PositionWire(), "P[-1]"),
        (PositionWire(), "P[12345]"),
    ],
)
def test_what_only_looks_like_a_value_does_not_fit(wire: Wire, text: str) -> None:
    assert not fits(wire, text)


@given(PULSES)
def test_every_position_survives_the_wire(pulses: int) -> None:
    for wire in (Number(), Signed(), Plain()):
        text = wire.encode(pulses)
        assert fits(wire, text)
        assert wire.decode(text) == pulses
    assert len(Signed().encode(pulses)) == 10


@given(st.integers(0, 99_999_999))
def test_every_number_of_hundredths_survives_the_wire(hundredths: int) -> None:
    value = hundredths / 100
    assert TypeAdapter(TwoDecimals).validate_python(value) == value
    for wire in (Hundredths(), PaddedHundredths(10)):
        text = wire.encode(value)
        assert fits(wire, text)
        assert wire.decode(text) == value


@pytest.mark.parametrize(
    ("kind", "lowest", "highest"),
    [(Pulses, 1 - BILLION, BILLION - 1), (Slot, 0, 29), (Flag, 0, 1), (Speed, 1, 1_000_000)],
)
def test_ranges_end_where_the_manual_says(kind: Any, lowest: int, highest: int) -> None:
    field = TypeAdapter[int](kind)
    assert [field.validate_python(value, strict=True) for value in (lowest, highest)] == [lowest, highest]
    for value in (lowest - 1, highest + 1):
        with pytest.raises(ValidationError):
            field.validate_python(value, strict=True)


@pytest.mark.parametrize("position", [-1, 2048, "+", "0", True, 5.0, None])
def test_a_position_number_is_strict(position: object) -> None:
    with pytest.raises(ValidationError):
        PositionReference.model_validate({"position": position})


def test_more_than_two_decimals_are_refused() -> None:
    with pytest.raises(ValidationError, match="two decimals"):
        TypeAdapter(TwoDecimals).validate_python(1.005)


def test_bounds_are_read_in_their_printed_width_only() -> None:
    assert Bounds.read("-999999999,+999999999") == Bounds(lower=-999_999_999, upper=999_999_999)
    with pytest.raises(SyntaxFault):
        Bounds.read("-1,+1")


@pytest.mark.parametrize(("lower", "upper"), [(5, 5), (6, 5), (5, None), (None, 5)])
def test_an_empty_or_half_interval_is_no_interval(lower: int | None, upper: int | None) -> None:
    class Limits(Interval, args="<{lower},{upper}>"):
        """Both or neither."""

    with pytest.raises(ValidationError):
        Limits(lower=lower, upper=upper)
    assert Limits(lower=-1, upper=5).written() == "-1,5"
    assert Limits().written() == ""
    with pytest.raises(RangeFault):
        Limits.read("5,5")
