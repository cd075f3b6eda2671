from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from protocols.rorze import speeds
from protocols.rorze.row import RorzeCommand
from protocols.table import RangeFault, Reply, Retry, SyntaxFault
from tests.protocols.rorze.examples import check_examples

SETTINGS: list[tuple[type[RorzeCommand[Any]], str, int, int]] = [
    (speeds.SetRisingAccelerationShare, "percent", 0, 100),
    (speeds.SetFallingAccelerationShare, "percent", 0, 100),
    (speeds.SetMaximumSpeed, "speed", 1, 1_000_000),
    (speeds.SetStartSpeed, "speed", 1, 30_000),
    (speeds.SetMaximumAcceleration, "acceleration", 1, 10_000_000),
]
QUERIES: list[type[RorzeCommand[Any]]] = [
    speeds.GetRisingAccelerationShare,
    speeds.GetFallingAccelerationShare,
    speeds.GetMaximumSpeed,
    speeds.GetStartSpeed,
    speeds.GetMaximumAcceleration,
]


@pytest.mark.parametrize("row", [*QUERIES, *(setting[0] for setting in SETTINGS)])
def test_the_manuals_examples(row: type[RorzeCommand[Any]]) -> None:
    check_examples(row)


def test_the_codes_begin_with_the_letter() -> None:
    codes = {row.code for row in QUERIES} | {setting[0].code for setting in SETTINGS}
    assert codes == {f"O{parameter}{verb}" for parameter in "ABHLS" for verb in "DS"}


@pytest.mark.parametrize(("row", "field", "least", "most"), SETTINGS)
def test_a_setting_keeps_its_range(row: type[RorzeCommand[Any]], field: str, least: int, most: int) -> None:
    for value in (least, most):
        assert getattr(row.read(str(value)), field) == value
        assert row.model_validate_json(f'{{"{field}": {value}}}').written() == str(value)
    for value in (least - 1, most + 1):
        with pytest.raises(RangeFault):
            row.read(str(value))
        with pytest.raises(ValidationError):
            row.model_validate({field: value})


@pytest.mark.parametrize("row", QUERIES)
def test_there_are_thirty_numbered_sets_and_a_standard_one(row: type[RorzeCommand[Any]]) -> None:
    assert row.read("S[29]").written() == "S[29]"
    assert row.read("").written() == ""
    with pytest.raises(RangeFault):
        row.read("S[30]")
    with pytest.raises(SyntaxFault):
        row.read("29")


@pytest.mark.parametrize("number", ["true", '"35"', "35.0", "null"])
def test_json_knows_whole_numbers_only(number: str) -> None:
    with pytest.raises(ValidationError):
        speeds.SetRisingAccelerationShare.model_validate_json(f'{{"percent": {number}}}')


def test_a_setting_may_be_written_in_hexadecimal_but_we_write_decimal() -> None:
    assert speeds.SetMaximumSpeed.read("S[12],HC350").written() == "S[12],50000"


@pytest.mark.parametrize(
    ("reply", "text"),
    [
        (speeds.PercentReply, "35"),
        (speeds.PercentReply, "0035"),
        (speeds.SpeedReply, "5000"),
        (speeds.AccelerationReply, "+0800000"),
    ],
)
def test_a_reply_has_its_printed_width(reply: type[Reply], text: str) -> None:
    with pytest.raises(SyntaxFault):
        reply.read(text)


def test_a_share_over_a_hundred_percent_is_no_reply() -> None:
    with pytest.raises(RangeFault):
        speeds.PercentReply.read("101")


@pytest.mark.parametrize(("row", "field", "least", "most"), SETTINGS)
@given(data=st.data())
def test_what_is_written_reads_back(
    row: type[RorzeCommand[Any]], field: str, least: int, most: int, data: st.DataObject
) -> None:
    speed_set = data.draw(st.none() | st.integers(0, 29))
    value = data.draw(st.integers(least, most))
    command = row.model_validate({field: value, "speed_set": speed_set})
    assert row.read(command.written()) == command


def test_settings_wait_for_standstill_and_questions_do_not() -> None:
    assert all(row.moving and row.retry is Retry.READ for row in QUERIES)
    assert not any(setting[0].moving for setting in SETTINGS)
    assert all(setting[0].retry is Retry.SETTING for setting in SETTINGS)
