import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from protocols.rorze import stall_sensor as sensor
from protocols.table import RangeFault, Retry, SyntaxFault
from tests.protocols.rorze.examples import Row, check_examples

ROWS: list[Row] = [
    sensor.GetStallSensorInterval,
    sensor.SetStallSensorInterval,
    sensor.GetStallSensorError,
    sensor.ClearStallSensorError,
    sensor.GetStallSensorDetection,
    sensor.SetStallSensorDetection,
]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.code)
def test_the_manuals_examples(row: Row) -> None:
    check_examples(row)


@given(st.integers(100, 65_535))
def test_every_interval_arrives_and_comes_back(interval: int) -> None:
    command = sensor.SetStallSensorInterval(interval=interval)
    assert sensor.SetStallSensorInterval.read(command.written()) == command
    reply = sensor.StallInterval(interval=interval)
    assert len(reply.written()) == 5
    assert sensor.GetStallSensorInterval().read_reply(reply.written()) == reply


@pytest.mark.parametrize(
    ("row", "parameters"),
    [
        (sensor.SetStallSensorInterval, "99"),
        (sensor.SetStallSensorInterval, "65536"),
        (sensor.SetStallSensorDetection, "2"),
    ],
)
def test_values_outside_their_range_are_refused(row: Row, parameters: str) -> None:
    with pytest.raises(RangeFault):
        row.read(parameters)


def test_the_interval_is_told_to_be_the_period_of_the_dogs() -> None:
    """13.6.2: half of it lies between two checks."""
    for model in (sensor.StallInterval, sensor.SetStallSensorInterval):
        assert "Period" in str(model.model_fields["interval"].description)


@pytest.mark.parametrize("value", [True, "1", 1.0, 2, None])
def test_detection_is_switched_with_0_or_1_and_nothing_else(value: object) -> None:
    with pytest.raises(ValidationError):
        sensor.SetStallSensorDetection.model_validate({"enabled": value})


@pytest.mark.parametrize("payload", ["", "00", "H1", "+1"])
def test_a_state_is_one_digit(payload: str) -> None:
    with pytest.raises(SyntaxFault):
        sensor.GetStallSensorError().read_reply(payload)
    with pytest.raises(SyntaxFault):
        sensor.GetStallSensorDetection().read_reply(payload)


def test_a_step_out_is_never_cleared_twice_unasked() -> None:
    assert sensor.ClearStallSensorError.retry is Retry.CONDITIONAL
