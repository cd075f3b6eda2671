import gc
import types
import weakref
from typing import Annotated, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, ValidationError

from protocols.rorze.notation import Digits, Number, PositionRef, PositionReference, Word
from protocols.table import (
    Ack,
    Choice,
    Command,
    RangeFault,
    Reply,
    Spoken,
    SyntaxFault,
    TextForm,
    Wire,
    WireFault,
    wire_of,
)

Amount = Annotated[int, Field(ge=0, le=99), Number()]


class Shapes(Spoken, args="<A[{slot}],>{amount}|{amount},F{start},S{speed}|"):
    """Three forms: with an optional group, with more fields, and empty."""

    slot: Amount | None = None
    amount: Amount | PositionRef | None = None
    start: Amount | None = None
    speed: Amount | None = None


@pytest.mark.parametrize(
    ("shape", "text"),
    [
        (Shapes(amount=5), "5"),
        (Shapes(amount=5, slot=3), "A[3],5"),
        (Shapes(amount=PositionReference(position="next")), "P[+]"),
        (Shapes(amount=5, start=1, speed=2), "5,F1,S2"),
        (Shapes(), ""),
    ],
)
def test_a_form_writes_and_reads_the_same_text(shape: Shapes, text: str) -> None:
    assert shape.written() == text
    assert Shapes.read(text) == shape


@pytest.mark.parametrize(
    "given_", [{"slot": 3}, {"start": 1}, {"amount": 5, "start": 1}, {"amount": 5, "slot": 3, "speed": 2}]
)
def test_a_combination_that_no_form_can_write_cannot_be_built(given_: dict[str, int]) -> None:
    with pytest.raises(ValidationError, match="cannot be written"):
        Shapes.model_validate(given_)


@pytest.mark.parametrize(
    "text", ["A[3]", "A[3],", "5,F1", "5,S2,F1", " 5", "5 ", "5\n", "a[3],5", "5,F1,S2,"]
)
def test_text_of_another_form_is_a_syntax_fault(text: str) -> None:
    with pytest.raises(SyntaxFault, match="not of the form"):
        Shapes.read(text)


@pytest.mark.parametrize("text", ["100", "-1", "A[100],5", "5,F1,S100", "P[2048]"])
def test_a_value_outside_its_range_is_a_range_fault(text: str) -> None:
    with pytest.raises(RangeFault):
        Shapes.read(text)


def test_a_fault_is_remembered_as_a_fault() -> None:
    for _ in range(2):
        with pytest.raises(RangeFault):
            Shapes.read("100")
        assert Shapes.read("99").amount == 99


def test_usage_tells_every_form() -> None:
    assert Shapes.usage() == ["<A[{slot}],>{amount}", "{amount},F{start},S{speed}", "no parameters"]


@pytest.mark.parametrize(
    "bad", [True, "5", 5.0, 5.5, float("nan"), float("inf"), None, b"5", [5], 1e400, " 5", "1_0", 10**30]
)
def test_json_values_are_taken_strictly(bad: object) -> None:
    class Row(Spoken, args="{amount}"):
        amount: Amount

    with pytest.raises(ValidationError):
        Row.model_validate({"amount": bad})


@pytest.mark.parametrize(
    "text", ['{"amount": true}', '{"amount": "5"}', '{"amount": 5.0}', '{"amount": NaN}']
)
def test_json_text_is_taken_strictly(text: str) -> None:
    with pytest.raises(ValidationError):
        Shapes.model_validate_json(text)


def test_unknown_fields_are_refused_and_known_ones_are_frozen() -> None:
    with pytest.raises(ValidationError):
        Shapes.model_validate({"amount": 5, "amounts": 5})
    with pytest.raises(ValidationError):
        Shapes(amount=5).amount = 6  # type: ignore[misc]  # that it is frozen is the point


@given(st.text(max_size=20))
def test_any_text_reads_or_is_a_wire_fault(text: str) -> None:
    try:
        shape = Shapes.read(text)
    except WireFault:
        return
    assert Shapes.read(shape.written()) == shape


@given(slot=st.none() | st.integers(0, 99), amount=st.integers(0, 99), by_index=st.booleans())
def test_what_can_be_built_survives_the_wire(slot: int | None, amount: int, by_index: bool) -> None:
    shape = Shapes(slot=slot, amount=PositionReference(position=amount) if by_index else amount)
    assert Shapes.read(shape.written()) == shape


# notations


def test_a_union_is_written_in_the_first_notation_that_holds_the_value() -> None:
    wire = wire_of(Amount | Annotated[Literal["endless"], Word(endless="Z")] | PositionRef)
    assert isinstance(wire, Choice)
    assert wire.encode(5) == "5"
    assert wire.encode("endless") == "Z"
    assert wire.encode(PositionReference(position=5)) == "P[5]"
    assert [wire.decode(text) for text in ("5", "Z")] == [5, "endless"]
    with pytest.raises(RangeFault):
        wire.encode("forever")
    with pytest.raises(SyntaxFault):
        wire.decode("forever")


def test_a_field_that_does_not_say_how_it_is_written_is_a_mistake_in_the_row() -> None:
    with pytest.raises(TypeError, match="does not say how"):

        class Silent(Spoken, args="{amount}"):
            amount: int


def test_the_plain_notation_is_the_text_itself() -> None:
    assert Wire().encode("x") == Wire().decode("x") == "x"


def test_nested_groups_may_be_left_out_from_the_inside() -> None:
    form = TextForm("a<b{x}<c{y}>>", {"x": Digits(1), "y": Digits(1)})
    assert form.variants() == {frozenset(), frozenset("x"), frozenset("xy")}
    assert [form.write(values) for values in ({}, {"x": 1}, {"x": 1, "y": 2})] == ["a", "ab1", "ab1c2"]
    assert form.read("ab1c2") == {"x": 1, "y": 2}
    assert form.read("ac2") is None


def test_signs_with_a_meaning_in_patterns_are_literal() -> None:
    form = TextForm("A[{x}].*+", {"x": Digits(1)})
    assert form.read("A[1].*+") == {"x": 1}
    assert form.read("A[1]xx+") is None


# replies


class Bit(Reply, args="{on}|{bits}"):
    """One bit, or all of them."""

    on: Annotated[int, Field(ge=0, le=1), Digits(1)] | None = None
    bits: Annotated[int, Field(ge=0, le=99), Digits(2)] | None = None


class AskBit(Command[Bit], args="{bit}|"):
    """ビット: a bit."""

    bit: Amount | None = None


def test_where_forms_correspond_the_reply_must_have_the_form_that_was_asked_for() -> None:
    assert AskBit(bit=3).read_reply("1") == Bit(on=1)
    assert AskBit().read_reply("01") == Bit(bits=1)
    with pytest.raises(SyntaxFault):
        AskBit(bit=3).read_reply("01")
    with pytest.raises(SyntaxFault):
        AskBit().read_reply("1")


def test_an_acknowledgement_is_empty() -> None:
    assert Ack.read("") == Ack()
    with pytest.raises(SyntaxFault):
        Ack.read(" ")


def test_a_command_that_does_not_say_what_is_answered_is_a_mistake() -> None:
    with pytest.raises(TypeError, match="what is answered"):
        Command.reply_type()


def test_a_row_inherits_what_is_answered_and_is_forgotten_with_its_last_user() -> None:
    row: type[AskBit] = types.new_class(
        "AskTwice", (AskBit,), exec_body=lambda body: body.update(__module__=__name__)
    )
    assert row.reply_type() is Bit
    alive = weakref.ref(row)
    del row
    gc.collect()
    assert alive() is None
