from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from protocols.rorze import input_logic as logic
from protocols.table import Command, RangeFault, SyntaxFault
from tests.protocols.rorze.examples import Row, check_examples

ROWS: list[Row] = [
    logic.GetNoiseFilter,
    logic.SetNoiseFilter,
    logic.GetInputLogic,
    logic.SetInputLogic,
    logic.GetSensorLogic,
    logic.SetSensorLogic,
]
CONTACTS = st.sampled_from(["normally_open", "normally_closed"])


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.code)
def test_the_manuals_examples(row: Row) -> None:
    check_examples(row)


@pytest.mark.parametrize(
    ("row", "inside", "outside"),
    [
        (logic.GetNoiseFilter, ["0", "8", "14"], ["15", "-1"]),
        (logic.SetNoiseFilter, ["0,1", "14,99", "99"], ["15,1", "0,0", "0,100", "0", "100"]),
        (logic.GetInputLogic, ["0", "9", ""], ["10", "-1"]),
        (logic.SetInputLogic, ["0,1", "9,0", "H0000", "H03FF"], ["10,1", "H0400"]),
        (logic.GetSensorLogic, ["0", "6", ""], ["7", "-1"]),
        (logic.SetSensorLogic, ["0,1", "6,0", "H00", "H7F"], ["7,1", "H80"]),
    ],
    ids=lambda value: getattr(value, "code", ""),
)
def test_values_at_the_edge_are_taken_and_those_beyond_it_refused(
    row: Row, inside: list[str], outside: list[str]
) -> None:
    for parameters in inside:
        assert row.read(parameters).written() == parameters
    for parameters in outside:
        with pytest.raises(RangeFault):
            row.read(parameters)


def test_a_filter_count_alone_goes_to_all_inputs() -> None:
    assert logic.SetNoiseFilter.read("5") == logic.SetNoiseFilter(count=5)
    assert logic.SetNoiseFilter(bit=14, count=5).written() == "14,5"


@pytest.mark.parametrize(
    ("row", "parameters"),
    [
        (logic.GetNoiseFilter, ""),
        (logic.SetNoiseFilter, ""),
        (logic.SetNoiseFilter, "1,"),
        (logic.SetInputLogic, "1"),
        (logic.SetInputLogic, "1,2"),
        (logic.SetSensorLogic, ""),
        (logic.SetSensorLogic, "H001"),
    ],
)
def test_parameters_of_another_form_are_no_command(row: Row, parameters: str) -> None:
    with pytest.raises(SyntaxFault):
        row.read(parameters)


@pytest.mark.parametrize(
    ("command", "payload"),
    [
        (logic.GetNoiseFilter(bit=3), "5"),
        (logic.GetInputLogic(bit=1), "H003F"),
        (logic.GetInputLogic(), "0"),
        (logic.GetSensorLogic(), "H003F"),
        (logic.GetSensorLogic(bit=6), "2"),
    ],
)
def test_the_answer_to_another_question_is_not_taken(command: Command[Any], payload: str) -> None:
    with pytest.raises(SyntaxFault):
        command.read_reply(payload)


@pytest.mark.parametrize(
    ("row", "text"),
    [
        (logic.SetInputLogic, '{"bit": 0, "contact": 1}'),
        (logic.SetInputLogic, '{"bit": 0}'),
        (logic.SetInputLogic, '{"contact": "normally_open"}'),
        (logic.SetInputLogic, '{"bit": 0, "contact": "normally_open", "bits": 1}'),
        (logic.SetSensorLogic, '{"bits": 1.0}'),
        (logic.SetNoiseFilter, '{"bit": 1}'),
        (logic.SetNoiseFilter, '{"count": true}'),
    ],
)
def test_json_that_is_no_command_is_refused(row: Row, text: str) -> None:
    with pytest.raises(ValidationError):
        row.model_validate_json(text)


@given(
    st.fixed_dictionaries({"bit": st.integers(0, 6), "contact": CONTACTS})
    | st.fixed_dictionaries({"bits": st.integers(0, 0x7F)})
)
def test_every_sensor_logic_arrives(values: dict[str, object]) -> None:
    for row in (logic.SetSensorLogic, logic.SetInputLogic):
        command = row.model_validate(values)
        assert row.read(command.written()) == command


@given(st.none() | st.integers(0, 14), st.integers(1, 99))
def test_every_noise_filter_arrives_and_comes_back(bit: int | None, count: int) -> None:
    command = logic.SetNoiseFilter(bit=bit, count=count)
    assert logic.SetNoiseFilter.read(command.written()) == command
    reply = logic.NoiseFilter(count=count)
    assert logic.GetNoiseFilter(bit=bit or 0).read_reply(reply.written()) == reply
