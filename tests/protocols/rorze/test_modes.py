import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from protocols.rorze import modes
from protocols.table import RangeFault, SyntaxFault
from tests.protocols.rorze.examples import Row, check_examples

ROWS: list[Row] = [
    modes.GetOperatingMode,
    modes.SetOperatingMode,
    modes.GetPulseFormat,
    modes.SetPulseFormat,
    modes.GetEventMask,
    modes.SetEventMask,
    modes.GetSoftLimits,
    modes.SetSoftLimits,
    modes.GetEventStatus,
    modes.GetEventKinds,
    modes.SetEventKinds,
]
MASKS = {
    "controller": st.integers(0, 0xFE),
    "end_cause": st.integers(0, 0x1F),
    "sensors": st.integers(0, 0x3F),
    "inputs": st.integers(0, 0x3FF),
}
REPORTS = {
    **MASKS,
    "controller": st.integers(0, 0xFF),
    "outputs": st.integers(0, 0xFFFF),
    "position": st.integers(-999_999_999, 999_999_999),
}


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.code)
def test_the_manuals_examples(row: Row) -> None:
    check_examples(row)


@pytest.mark.parametrize(("word", "sign"), [("stepping", "0"), ("encoder", "1"), ("servo", "2")])
def test_operating_modes_have_names(word: str, sign: str) -> None:
    assert modes.SetOperatingMode.model_validate({"mode": word}).written() == sign
    assert modes.GetOperatingMode().read_reply(sign).mode == word


@pytest.mark.parametrize(("word", "sign"), [("pulse_direction", "0"), ("cw_ccw", "1")])
def test_pulse_formats_have_names(word: str, sign: str) -> None:
    assert modes.SetPulseFormat.model_validate({"pulse_format": word}).written() == sign
    assert modes.GetPulseFormat().read_reply(sign).pulse_format == word


@pytest.mark.parametrize(
    ("row", "parameters"),
    [
        (modes.SetOperatingMode, "3"),
        (modes.SetOperatingMode, ""),
        (modes.SetPulseFormat, "2"),
        (modes.SetSoftLimits, "5"),
        (modes.SetSoftLimits, "5,"),
        (modes.SetEventMask, "C:6"),
        (modes.SetEventMask, "C:H6"),
        (modes.SetEventMask, "C:H06,"),
        (modes.SetEventMask, ",C:H06"),
        (modes.SetEventMask, "C:H06I:H0001"),
        (modes.SetEventMask, "C:H06,C:H06"),
        (modes.SetEventMask, "O:H0001"),
        (modes.SetEventKinds, "C,"),
        (modes.SetEventKinds, "CI"),
        (modes.SetEventKinds, "X"),
        (modes.GetEventMask, "C"),
    ],
)
def test_parameters_of_another_form_are_no_command(row: Row, parameters: str) -> None:
    with pytest.raises(SyntaxFault):
        row.read(parameters)


@pytest.mark.parametrize(
    ("row", "parameters"),
    [
        (modes.SetEventMask, "C:HFF"),
        (modes.SetEventMask, "M:H20"),
        (modes.SetEventMask, "S:H40"),
        (modes.SetEventMask, "I:H0400"),
        (modes.SetEventKinds, "C,I,C"),
        (modes.SetSoftLimits, "5,5"),
        (modes.SetSoftLimits, "5,4"),
        (modes.SetSoftLimits, "-1000000000,4"),
        (modes.SetSoftLimits, "4,1000000000"),
    ],
)
def test_values_outside_their_range_are_refused(row: Row, parameters: str) -> None:
    with pytest.raises(RangeFault):
        row.read(parameters)


@pytest.mark.parametrize(
    ("row", "text"),
    [
        (modes.SetOperatingMode, '{"mode": 0}'),
        (modes.SetOperatingMode, '{"mode": "0"}'),
        (modes.SetEventMask, "{}"),
        (modes.SetEventMask, '{"mask": {"controller": "H06"}}'),
        (modes.SetEventMask, '{"mask": {"controller": true}}'),
        (modes.SetEventMask, '{"mask": {"position": 1}}'),
        (modes.SetEventKinds, '{"kinds": "controller"}'),
        (modes.SetEventKinds, '{"kinds": ["C"]}'),
        (modes.SetEventKinds, '{"kinds": ["inputs", "inputs"]}'),
        (modes.SetSoftLimits, '{"lower": 1}'),
        (modes.SetSoftLimits, '{"lower": 1.0, "upper": 2}'),
    ],
)
def test_json_that_is_no_command_is_refused(row: Row, text: str) -> None:
    with pytest.raises(ValidationError):
        row.model_validate_json(text)


def test_a_mask_left_out_is_left_out_on_the_wire_too() -> None:
    command = modes.SetEventMask(mask=modes.EventMask(sensors=0x20, inputs=1))
    assert command.written() == "S:H20,I:H0001"
    assert modes.SetEventMask(mask=modes.EventMask()).written() == ""


def test_masks_are_read_in_the_order_the_manual_prints_them_too() -> None:
    reply = modes.GetEventMask().read_reply("C:H06,S:H00,M:H00,I:H0001")
    assert reply.mask == modes.EventMask(controller=6, end_cause=0, sensors=0, inputs=1)


def test_a_controller_in_motion_may_say_so_in_its_status() -> None:
    assert modes.GetEventStatus().read_reply("C:H01").status == modes.EventReport(controller=1)


def test_the_edges_of_the_soft_limits() -> None:
    assert modes.SetSoftLimits(lower=-999_999_999, upper=999_999_999).written() == "-999999999,999999999"
    assert modes.SetSoftLimits().written() == ""


@given(st.fixed_dictionaries({}, optional=MASKS))
def test_every_event_mask_arrives_and_comes_back(masks: dict[str, int]) -> None:
    command = modes.SetEventMask(mask=modes.EventMask.model_validate(masks))
    assert modes.SetEventMask.read(command.written()) == command
    assert modes.GetEventMask().read_reply(command.written()).mask == command.mask


@given(st.fixed_dictionaries({}, optional=REPORTS))
def test_every_event_status_comes_back_forwards_and_backwards(values: dict[str, int]) -> None:
    reply = modes.EventStatus(status=modes.EventReport.model_validate(values))
    parts = reply.written().split(",")
    assert modes.GetEventStatus().read_reply(",".join(parts)) == reply
    assert modes.GetEventStatus().read_reply(",".join(reversed(parts))) == reply


@given(st.permutations(list(modes.STATUS_LETTERS)), st.integers(0, 6))
def test_every_choice_of_kinds_arrives_in_its_order(kinds: list[str], many: int) -> None:
    command = modes.SetEventKinds.model_validate({"kinds": kinds[:many]})
    assert modes.SetEventKinds.read(command.written()) == command
    assert modes.GetEventKinds().read_reply(command.written()).kinds == command.kinds
