import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from protocols.rorze import position
from protocols.table import RangeFault, SyntaxFault
from tests.protocols.rorze.examples import Row, check_examples

ROWS: list[Row] = [
    position.GetEncoderCount,
    position.SetEncoderCount,
    position.GetEncoderPosition,
    position.GetPosition,
    position.SetPosition,
]
SETTERS = [
    pytest.param(position.SetPosition, "position", "encoder", "C", id="6PS"),
    pytest.param(position.SetEncoderCount, "count", "position", "P", id="6ES"),
]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.code)
def test_the_manuals_examples(row: Row) -> None:
    check_examples(row)


@given(st.integers(-999_999_999, 999_999_999))
def test_every_position_is_read_as_it_was_answered(pulses: int) -> None:
    payload = position.SignedPulses(pulses=pulses).written()
    assert len(payload) == 10
    assert position.GetPosition().read_reply(payload).pulses == pulses


@pytest.mark.parametrize("payload", ["", "50000", "+50000", "000050000", "+0000500000", "+00005000 ", "@4A"])
def test_a_reply_that_is_cut_or_stretched_is_no_position(payload: str) -> None:
    with pytest.raises(SyntaxFault):
        position.GetPosition().read_reply(payload)


@pytest.mark.parametrize(("row", "field", "word", "sign"), SETTERS)
def test_a_counter_takes_a_number_or_the_other_counter(row: Row, field: str, word: str, sign: str) -> None:
    assert row.model_validate({field: word}).written() == sign
    for value in (-999_999_999, 0, 999_999_999):
        assert row.read(row.model_validate({field: value}).written()) == row.model_validate({field: value})


@pytest.mark.parametrize(("row", "field", "word", "sign"), SETTERS)
def test_a_counter_takes_nothing_else(row: Row, field: str, word: str, sign: str) -> None:
    for value in (-1_000_000_000, 1_000_000_000, True, 5.0, "5", sign, None):
        with pytest.raises(ValidationError):
            row.model_validate({field: value})
    with pytest.raises(RangeFault):
        row.read("-1000000000")
    with pytest.raises(SyntaxFault):
        row.read(word)
