import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from protocols.rorze import position_table
from protocols.rorze.notation import PositionReference
from protocols.table import RangeFault, Retry, SyntaxFault
from tests.protocols.rorze.examples import Row, check_examples

ARITHMETIC: list[Row] = [
    position_table.AddToPositionEntry,
    position_table.SubtractFromPositionEntry,
    position_table.MultiplyPositionEntry,
    position_table.DividePositionEntry,
]
ROWS: list[Row] = [
    *ARITHMETIC,
    position_table.ClearPositionEntries,
    position_table.GetPositionIndex,
    position_table.SetPositionIndex,
    position_table.GetNumberedPositionEntry,
    position_table.GetPositionEntry,
    position_table.SetPositionEntry,
]
NEXT = PositionReference(position="next")

entries = st.builds(PositionReference, position=st.integers(0, 2047) | st.sampled_from(["next", "previous"]))
amounts = st.integers(-999_999_999, 999_999_999)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.code)
def test_the_manuals_examples(row: Row) -> None:
    check_examples(row)


@pytest.mark.parametrize("row", ARITHMETIC, ids=lambda row: row.code)
def test_arithmetic_is_never_repeated(row: Row) -> None:
    assert row.retry is Retry.NEVER


@given(entry=entries, pulses=st.none() | amounts)
def test_a_setting_reads_back_as_written(entry: PositionReference, pulses: int | None) -> None:
    command = position_table.SetPositionEntry(entry=entry, pulses=pulses)
    assert position_table.SetPositionEntry.read(command.written()) == command


@given(entry=entries, amount=amounts)
def test_a_sum_reads_back_as_written(entry: PositionReference, amount: int) -> None:
    command = position_table.AddToPositionEntry(entry=entry, amount=amount)
    assert position_table.AddToPositionEntry.read(command.written()) == command


def test_nothing_is_divided_by_zero() -> None:
    with pytest.raises(ValidationError, match="divided by zero"):
        position_table.DividePositionEntry(entry=NEXT, divisor=0)
    with pytest.raises(RangeFault):
        position_table.DividePositionEntry.read("P[1],0")
    assert position_table.DividePositionEntry(entry=NEXT, divisor=-1).written() == "P[+],-1"


def test_the_table_ends_at_2047() -> None:
    assert position_table.SetPositionIndex(position=2047).written() == "2047"
    with pytest.raises(RangeFault):
        position_table.SetPositionIndex.read("2048")
    with pytest.raises(RangeFault):
        position_table.GetPositionEntry.read("P[2048]")


@pytest.mark.parametrize("parameters", ["", "25", "P[]", "P[25", "P[+1]", "P[25],"])
def test_the_controller_refuses_what_is_no_entry(parameters: str) -> None:
    with pytest.raises(SyntaxFault):
        position_table.SetPositionEntry.read(parameters)


def test_an_answer_about_another_entry_is_not_ours() -> None:
    asked = position_table.GetNumberedPositionEntry.read("P[25]")
    with pytest.raises(SyntaxFault, match="repeats position as 26"):
        asked.read_reply("P[0026],+000000050")


def test_an_answer_about_the_next_entry_tells_which_it_was() -> None:
    asked = position_table.GetNumberedPositionEntry(entry=NEXT)
    assert asked.read_reply("P[0026],+000000050").position == 26


@pytest.mark.parametrize("payload", ["P[25],+000000050", "P[0025],50", "P[0025]", "P[00025],+000000050"])
def test_an_answer_of_another_width_is_no_entry(payload: str) -> None:
    with pytest.raises(SyntaxFault):
        position_table.GetNumberedPositionEntry.read("P[25]").read_reply(payload)


def test_an_answer_beyond_the_table_is_no_entry() -> None:
    with pytest.raises(RangeFault):
        position_table.GetNumberedPositionEntry(entry=NEXT).read_reply("P[2048],+000000050")


def test_an_index_that_has_left_the_table_is_no_garbled_question() -> None:
    """13.4.3: only 3IS helps then."""
    assert not position_table.GetPositionIndex().rules_out(0x5D)
