from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from protocols.rorze import encoder
from protocols.table import Command, RangeFault, Retry, SyntaxFault
from tests.protocols.rorze.examples import Row, check_examples

ROWS: list[Row] = [
    encoder.GetEncoderMultiplier,
    encoder.SetEncoderMultiplier,
    encoder.GetEncoderRatio,
    encoder.SetEncoderRatio,
    encoder.GetEncoderStallThreshold,
    encoder.SetEncoderStallThreshold,
    encoder.GetAdjustment,
    encoder.SetAdjustment,
    encoder.GetAdjustmentLimit,
    encoder.SetAdjustmentLimit,
    encoder.GetAdjustmentSpeed,
    encoder.SetAdjustmentSpeed,
    encoder.GetEncoderStallError,
    encoder.ClearEncoderStallError,
    encoder.GetEncoderStallDetection,
    encoder.SetEncoderStallDetection,
    encoder.GetAdjustmentDelay,
    encoder.SetAdjustmentDelay,
]
COUNTS = [
    pytest.param(encoder.SetEncoderStallThreshold, encoder.GetEncoderStallThreshold, 0, 3_000, 5, id="PES"),
    pytest.param(encoder.SetAdjustmentLimit, encoder.GetAdjustmentLimit, 1, 65_535, 5, id="PKS"),
    pytest.param(encoder.SetAdjustmentSpeed, encoder.GetAdjustmentSpeed, 0, 50_000, 8, id="PLS"),
    pytest.param(encoder.SetAdjustmentDelay, encoder.GetAdjustmentDelay, 0, 999, 5, id="PTS"),
]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.code)
def test_the_manuals_examples(row: Row) -> None:
    check_examples(row)


@pytest.mark.parametrize(("setter", "getter", "least", "most", "width"), COUNTS)
def test_a_count_has_its_range_and_its_printed_width(
    setter: Row, getter: Row, least: int, most: int, width: int
) -> None:
    for value in (least, most):
        command = setter.read(f"{value}")
        assert command.written() == f"{value}"
        payload = f"{value:0{width}d}"
        assert getter().read_reply(payload).model_dump() == command.model_dump()
        with pytest.raises(SyntaxFault):
            getter().read_reply("0" + payload)
    for value in (least - 1, most + 1):
        with pytest.raises(RangeFault):
            setter.read(f"{value}")


@given(st.integers(100, 9_999_999))
def test_every_ratio_arrives_and_comes_back(hundredths: int) -> None:
    command = encoder.SetEncoderRatio(ratio=hundredths / 100)
    assert command.written() == f"{hundredths // 100}.{hundredths % 100:02d}"
    assert encoder.SetEncoderRatio.read(command.written()) == command
    reply = encoder.EncoderRatio(ratio=hundredths / 100)
    assert reply.written() == f"{hundredths // 100:05d}.{hundredths % 100:02d}"
    assert encoder.GetEncoderRatio().read_reply(reply.written()) == reply


@pytest.mark.parametrize("parameters", ["200", "200.", "200.005", "H64"])
def test_a_ratio_is_written_with_a_point_and_one_or_two_decimals(parameters: str) -> None:
    assert encoder.SetEncoderRatio.read("200.5").ratio == 200.5
    with pytest.raises(SyntaxFault):
        encoder.SetEncoderRatio.read(parameters)


@pytest.mark.parametrize("parameters", ["0.99", "100000.00", "0.0"])
def test_a_ratio_outside_its_range_is_refused(parameters: str) -> None:
    with pytest.raises(RangeFault):
        encoder.SetEncoderRatio.read(parameters)


@pytest.mark.parametrize("text", ["1.005", "true", '"2.5"', "NaN", "Infinity", "1e9", "null"])
def test_json_that_is_no_ratio_is_refused(text: str) -> None:
    with pytest.raises(ValidationError):
        encoder.SetEncoderRatio.model_validate_json(f'{{"ratio": {text}}}')


@pytest.mark.parametrize("value", [2, 4, 4.0, "4", True, None])
def test_the_multiplier_is_a_word(value: object) -> None:
    assert encoder.SetEncoderMultiplier(multiplier="double").written() == "2"
    with pytest.raises(ValidationError):
        encoder.SetEncoderMultiplier.model_validate({"multiplier": value})


@pytest.mark.parametrize(
    ("command", "payload"),
    [
        (encoder.GetEncoderMultiplier(), "3"),
        (encoder.GetEncoderRatio(), "200.00"),
        (encoder.GetEncoderRatio(), "00200.0"),
        (encoder.GetEncoderRatio(), "0200.000"),
        (encoder.GetAdjustment(), "01"),
        (encoder.GetEncoderStallError(), ""),
        (encoder.GetEncoderStallDetection(), "H"),
        (encoder.GetEncoderStallThreshold(), "-0001"),
    ],
)
def test_a_reply_of_another_form_is_not_taken(command: Command[Any], payload: str) -> None:
    with pytest.raises(SyntaxFault):
        command.read_reply(payload)


def test_adjustment_exists_only_in_encoder_mode() -> None:
    assert {row.code for row in ROWS if row.modes == "1"} == {
        f"P{letter}{verb}" for letter in "JKLT" for verb in "DS"
    }


def test_no_setting_is_changed_in_motion_and_every_one_can_be_read_then() -> None:
    assert all(row.moving is (row.retry is Retry.READ) for row in ROWS)
