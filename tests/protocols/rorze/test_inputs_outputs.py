from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from protocols.rorze import inputs_outputs as io
from protocols.rorze.notation import Bounds
from protocols.table import Command, RangeFault, SyntaxFault
from tests.protocols.rorze.examples import Row, check_examples

ROWS: list[Row] = [
    io.PulseOutput,
    io.GetClearPulseTime,
    io.SetClearPulseTime,
    io.GetErrorOutput,
    io.SetErrorOutput,
    io.GetInterruptAction,
    io.SetInterruptAction,
    io.GetInputs,
    io.GetSensors,
    io.SetClearSignal,
    io.GetOutputs,
    io.SetOutputs,
    io.GetInterruptMode,
    io.SetInterruptMode,
    io.GetErrorOutputStatus,
    io.ClearErrorOutputStatus,
    io.GetInterruptRange,
    io.SetInterruptRange,
]
POSITIONS = st.integers(-999_999_999, 999_999_999)
FLAGS = st.integers(0, 1)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.code)
def test_the_manuals_examples(row: Row) -> None:
    check_examples(row)


@pytest.mark.parametrize(
    ("row", "inside", "outside"),
    [
        (io.PulseOutput, ["0,1", "15,999999999"], ["16,1", "-1,1", "0,0", "0,1000000000"]),
        (io.SetClearPulseTime, ["0", "999999999"], ["-1", "1000000000"]),
        (io.SetErrorOutput, ["E,0,0", "A,15,1"], ["E,16,0", "E,0,2"]),
        (
            io.SetInterruptAction,
            ["8,P:0", "9,C:2047", "9,E:", "8,O:0,0,1", "9,O:7,1,30000", "8,O:"],
            ["7,P:", "10,P:", "8,P:2048", "8,O:8,1,1", "8,O:0,2,1", "8,O:0,1,0", "8,O:0,1,30001"],
        ),
        (io.GetInputs, ["0", "9", ""], ["10", "-1"]),
        (io.GetSensors, ["0", "5", ""], ["6", "-1"]),
        (io.SetClearSignal, ["0", "1"], ["2", "-1"]),
        (io.GetOutputs, ["0", "15", "CL", ""], ["16", "-1"]),
        (io.SetOutputs, ["0,1", "15,0", "CL,1", "H0000", "HFFFF"], ["16,1", "0,2", "CL,2"]),
        (io.GetInterruptMode, ["8", "9"], ["7", "10"]),
        (io.SetInterruptMode, ["8,0", "9,2"], ["7,0", "10,0"]),
        (io.SetInterruptRange, ["8,-999999999,999999999", "9"], ["8,0,1000000000", "8,-1000000000,0"]),
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


@pytest.mark.parametrize(
    ("row", "parameters"),
    [
        (io.PulseOutput, "1"),
        (io.PulseOutput, "1,1000,"),
        (io.GetErrorOutput, ""),
        (io.GetErrorOutput, "e"),
        (io.SetErrorOutput, "E,2"),
        (io.SetErrorOutput, "E,,1"),
        (io.GetInterruptAction, "8"),
        (io.GetInterruptAction, "8,X"),
        (io.SetInterruptAction, "8,O:5"),
        (io.SetInterruptAction, "8,P:5,1,10"),
        (io.SetInterruptAction, "8,O:25"),
        (io.GetInputs, "1.0"),
        (io.GetOutputs, "cl"),
        (io.SetOutputs, ""),
        (io.SetOutputs, "3"),
        (io.SetOutputs, "H10000"),
        (io.SetOutputs, "003D"),
        (io.SetInterruptMode, "8,3"),
        (io.SetInterruptRange, "8,-50"),
        (io.ClearErrorOutputStatus, "E"),
    ],
)
def test_parameters_of_another_form_are_no_command(row: Row, parameters: str) -> None:
    with pytest.raises(SyntaxFault):
        row.read(parameters)


@pytest.mark.parametrize(
    ("row", "text"),
    [
        (io.PulseOutput, '{"bit": true, "duration_ms": 1}'),
        (io.PulseOutput, '{"bit": 1, "duration_ms": 5.0}'),
        (io.GetOutputs, '{"bit": "CL"}'),
        (io.GetOutputs, '{"bit": "1"}'),
        (io.SetOutputs, '{"bit": 1}'),
        (io.SetOutputs, '{"bit": 1, "on": 1, "bits": 2}'),
        (io.SetOutputs, '{"bits": "H003D"}'),
        (io.SetErrorOutput, '{"cause": "ems", "output": 2}'),
        (io.SetErrorOutput, '{"cause": "E"}'),
        (io.SetInterruptAction, '{"port": 8}'),
        (io.SetInterruptAction, '{"port": 8, "recorded": "position", "pulsed": "output"}'),
        (io.SetInterruptAction, '{"port": 8, "recorded": "position", "output": 5}'),
        (io.SetInterruptMode, '{"port": 8, "edge": 1}'),
        (io.SetInterruptRange, '{"port": 8, "lower": 5}'),
        (io.SetInterruptRange, '{"port": 8, "lower": 5, "upper": 5}'),
    ],
)
def test_json_that_is_no_command_is_refused(row: Row, text: str) -> None:
    with pytest.raises(ValidationError):
        row.model_validate_json(text)


@pytest.mark.parametrize(
    ("command", "payload"),
    [
        (io.GetInputs(bit=5), "H003C"),
        (io.GetInputs(), "1"),
        (io.GetInputs(), "H03C"),
        (io.GetSensors(), "H0003"),
        (io.GetSensors(bit=0), ""),
        (io.GetErrorOutputStatus(), "H04"),
        (io.GetErrorOutputStatus(cause="ems"), "H4"),
        (io.GetInterruptAction(port=8, recorded="position"), "5,1,00010"),
        (io.GetInterruptAction(port=8, recorded="position"), "25"),
        (io.GetInterruptAction(port=8, pulsed="output"), "0025"),
        (io.GetInterruptAction(port=8, pulsed="output"), "5,1,10"),
        (io.GetErrorOutput(cause="any"), "2"),
        (io.GetClearPulseTime(), "50"),
        (io.GetInterruptMode(port=8), "3"),
        (io.GetInterruptRange(port=8), "-50,50"),
    ],
)
def test_the_answer_to_another_question_is_not_taken(command: Command[Any], payload: str) -> None:
    with pytest.raises(SyntaxFault):
        command.read_reply(payload)


def test_bits_that_no_input_has_are_not_taken() -> None:
    for command, payload in ((io.GetInputs(), "H0400"), (io.GetSensors(), "H40"), (io.GetInputs(bit=1), "2")):
        with pytest.raises(RangeFault):
            command.read_reply(payload)


def test_a_short_mask_is_read_and_a_full_one_written() -> None:
    assert io.SetOutputs.read("H3D") == io.SetOutputs(bits=0x3D)
    assert io.SetOutputs(bits=0x3D).written() == "H003D"


def test_an_interrupt_range_has_an_inside() -> None:
    for parameters in ("8,50,50", "8,50,-50"):
        with pytest.raises(RangeFault, match="lower must be less than upper"):
            io.SetInterruptRange.read(parameters)


@given(st.integers(8, 9), st.tuples(POSITIONS, POSITIONS).filter(lambda ends: ends[0] < ends[1]))
def test_every_interrupt_range_arrives_and_comes_back(port: int, ends: tuple[int, int]) -> None:
    command = io.SetInterruptRange(port=port, lower=ends[0], upper=ends[1])
    assert io.SetInterruptRange.read(command.written()) == command
    bounds = Bounds(lower=ends[0], upper=ends[1])
    assert io.GetInterruptRange(port=port).read_reply(bounds.written()) == bounds


@given(
    st.integers(8, 9),
    st.fixed_dictionaries(
        {"recorded": st.sampled_from(["position", "encoder", "encoder_in_pulses"])},
        optional={"number": st.integers(0, 2047)},
    )
    | st.just({"pulsed": "output"})
    | st.fixed_dictionaries(
        {
            "pulsed": st.just("output"),
            "output": st.integers(0, 7),
            "state": FLAGS,
            "duration_ms": st.integers(1, 30_000),
        }
    ),
)
def test_every_interrupt_action_arrives(port: int, action: dict[str, object]) -> None:
    command = io.SetInterruptAction.model_validate({"port": port, **action})
    assert io.SetInterruptAction.read(command.written()) == command


@given(
    st.fixed_dictionaries({"bit": st.integers(0, 15) | st.just("clear"), "on": FLAGS})
    | st.fixed_dictionaries({"bits": st.integers(0, 0xFFFF)})
)
def test_every_setting_of_the_outputs_arrives(values: dict[str, object]) -> None:
    command = io.SetOutputs.model_validate(values)
    assert io.SetOutputs.read(command.written()) == command


@given(st.sampled_from(["ems", "limit", "stall", "any"]), st.integers(0, 15), FLAGS)
def test_every_error_output_arrives_and_comes_back(cause: str, output: int, state: int) -> None:
    command = io.SetErrorOutput.model_validate({"cause": cause, "output": output, "state": state})
    assert io.SetErrorOutput.read(command.written()) == command
    reply = io.ErrorOutput(output=output, state=state)
    assert io.GetErrorOutput.model_validate({"cause": cause}).read_reply(reply.written()) == reply
