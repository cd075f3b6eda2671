import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from protocols.fics.commands import Row, read
from protocols.fics.homing import SetHomingTypes
from protocols.fics.jog import StepAxis
from protocols.fics.macros import RunMacro
from protocols.fics.moves import MoveAbsolute
from protocols.fics.notation import LARGEST, AxisSystem, Decimal, Quantity
from protocols.fics.speeds import (
    GetMaximumSpeeds,
    SetAccelerationTimes,
    SetMaximumSpeeds,
    SetSelfStartSpeeds,
    SetSpeedPercent,
)
from protocols.fics.status import GetUserPosition
from protocols.table import RangeFault, SyntaxFault

# holes


@pytest.mark.parametrize(
    ("arguments", "percents"),
    [
        ("10,,30,,", [10, None, 30]),
        ("10,,30", [10, None, 30]),
        (",50", [None, 50]),
        ("10", [10]),
    ],
)
def test_a_hole_leaves_an_axis_as_it_is(arguments: str, percents: list[float | None]) -> None:
    assert SetSpeedPercent.read(arguments) == SetSpeedPercent(percents=percents)


def test_commas_at_the_end_are_not_written() -> None:
    assert SetSpeedPercent(percents=[10, None, 30, None, None]).text == "VAO 10,,30"


@pytest.mark.parametrize("percents", [[], [None], [None, None]])
def test_a_setting_that_names_no_axis_cannot_be_built(percents: list[float | None]) -> None:
    # Written without arguments it would be the query of the same name.
    with pytest.raises(ValidationError):
        SetSpeedPercent(percents=percents)


@pytest.mark.parametrize("arguments", ["", ",", ",,", "1,2,3,4,5,6,7,8,9", "1,,x", "1;2", "#####", "--1"])
def test_a_list_that_is_badly_written_is_told_so(arguments: str) -> None:
    with pytest.raises(SyntaxFault):
        MoveAbsolute.read(arguments)


# numbers


@pytest.mark.parametrize(
    ("text", "value"), [("+10", 10), ("-007.50", -7.5), (".5", 0.5), ("3.", 3), ("-.25", -0.25), ("-0", 0)]
)
def test_signs_and_zeros_in_front_may_be_left_out(text: str, value: float) -> None:
    assert MoveAbsolute.read(text).coordinates == [value]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (10, "10"),
        (-0.0, "0"),
        (12.5, "12.5"),
        (-0.001, "-0.001"),
        (LARGEST, "99999999"),
        (0.1 + 0.2 - 0.3, None),
    ],
)
def test_coordinates_are_written_in_their_shortest_form(value: float, text: str | None) -> None:
    if text is None:
        with pytest.raises(ValidationError, match="decimals"):
            MoveAbsolute(coordinates=[value])
    else:
        assert MoveAbsolute(coordinates=[value]).written() == text


@pytest.mark.parametrize("text", ["1e5", "1_0", " 5", "0x5", "5,5.5.5", "nan", "inf", "٣", "."])
def test_what_only_python_takes_for_a_number_is_none(text: str) -> None:
    with pytest.raises(SyntaxFault):
        MoveAbsolute.read(text)


@given(st.integers(-LARGEST * 1000, LARGEST * 1000).map(lambda thousandths: thousandths / 1000))
def test_a_coordinate_survives_the_wire(value: float) -> None:
    move = MoveAbsolute(coordinates=[value])
    assert MoveAbsolute.read(move.written()) == move


@given(st.floats(-1e9, 1e9), st.sampled_from([0, 1]), st.booleans())
def test_a_number_written_is_a_number_that_can_be_read(value: float, least: int, signed: bool) -> None:
    wire = Decimal(least=least, signed=signed)
    text = wire.encode(value)
    assert re.fullmatch(wire.pattern, text)
    assert wire.decode(text) == pytest.approx(value, abs=1e-6)


# ranges


@pytest.mark.parametrize("text", ["0.1", "100", "100.0", "99.99", "50.", "0.125"])
def test_a_percentage_lies_between_a_tenth_and_a_hundred(text: str) -> None:
    assert 0.1 <= (SetSpeedPercent.read(text).percents[0] or 0) <= 100


@pytest.mark.parametrize("text", ["0", "0.0", "0.09", "100.1", "-5", "999"])
def test_other_percentages_are_out_of_range(text: str) -> None:
    with pytest.raises(RangeFault):
        SetSpeedPercent.read(text)


@pytest.mark.parametrize("text", ["100.00", "000010", "33.333"])
def test_a_percentage_has_no_more_than_five_characters(text: str) -> None:
    with pytest.raises(RangeFault):
        SetSpeedPercent.read(text)


@pytest.mark.parametrize(
    ("name", "widest", "too_wide"),
    [
        ("VST", "0100,,9999", "00100"),  # 2-31
        ("VSS", "9999", "1,10000"),  # 2-32
        ("MST", "0001", "00001"),  # 4-7
        ("MSS", "9999", "99999"),  # 4-8
        ("VSB", "0000,+9999", "00000"),  # 2-29
        ("VAO", "100.0,00.10", "100.00"),  # 2-15
        ("MAO", "100.0", "1.0000"),  # 4-5
        ("JTE", "X-255", "X0255"),  # 2-3
        ("VAR", "V99", "V099"),  # 2-35
        ("LMI", "99999999", "1" * 400),
    ],
)
def test_what_is_longer_than_its_page_allows_is_out_of_range(name: str, widest: str, too_wide: str) -> None:
    read(name, widest)
    with pytest.raises(RangeFault):
        read(name, too_wide)


def test_a_percentage_that_needs_more_than_five_characters_cannot_be_built() -> None:
    assert SetSpeedPercent(percents=[33.33]).written() == "33.33"
    with pytest.raises(ValidationError, match="5 characters"):
        SetSpeedPercent(percents=[33.333])


def test_times_starts_and_homing_types_have_the_manuals_ranges() -> None:
    assert SetAccelerationTimes.read("1,9999").times_ms == [1, 9999]
    assert SetSelfStartSpeeds.read("0,9999").speeds_pps == [0, 9999]
    assert SetHomingTypes.read("0,6").types == [0, 6]
    rows: list[tuple[Row, str]] = [
        (SetAccelerationTimes, "0"),
        (SetAccelerationTimes, "10000"),
        (SetSelfStartSpeeds, "-1"),
        (SetSelfStartSpeeds, "10000"),
        (SetHomingTypes, "7"),
        (SetMaximumSpeeds, "0"),
        (SetMaximumSpeeds, "-1"),
        (MoveAbsolute, "100000000"),
    ]
    for row, text in rows:
        with pytest.raises(RangeFault):
            row.read(text)


# answers


def test_a_position_that_is_not_known_is_no_number() -> None:
    asked = GetUserPosition()
    assert asked.read_reply("1.5,#####").coordinates == [1.5, None]
    assert asked.read_reply("#####").coordinates == [None]
    for text in ("", "1.5,", "1.5,####", "1.5,######"):
        with pytest.raises(SyntaxFault):
            asked.read_reply(text)


def test_an_answer_has_no_holes() -> None:
    with pytest.raises(SyntaxFault):
        GetMaximumSpeeds().read_reply("300,,310")


# units


def test_units_follow_the_axis_system() -> None:
    units = {system: (system.unit(Quantity.POSITION), system.unit(Quantity.SPEED)) for system in AxisSystem}
    assert units == {
        AxisSystem.MILLIMETRE: ("mm", "mm/s"),
        AxisSystem.PULSE: ("pulse", "kpps"),
        AxisSystem.DEGREE: ("degree", "rpm"),
    }


def test_only_positions_in_pulses_have_to_be_whole() -> None:
    assert not AxisSystem.PULSE.can_hold(Quantity.POSITION, 0.5)
    assert AxisSystem.PULSE.can_hold(Quantity.POSITION, -3.0)
    assert AxisSystem.PULSE.can_hold(Quantity.SPEED, 0.5)
    assert AxisSystem.MILLIMETRE.can_hold(Quantity.POSITION, 0.5)


def test_fields_say_what_they_measure() -> None:
    assert Quantity.POSITION in MoveAbsolute.model_fields["coordinates"].metadata
    assert Quantity.SPEED in SetMaximumSpeeds.model_fields["speeds"].metadata


# what is said about what cannot be


@pytest.mark.parametrize(
    ("row", "parameters", "says"),
    [
        (SetAccelerationTimes, {"times_ms": [0]}, "must be a whole number from 1 to 9999"),
        (SetAccelerationTimes, {"times_ms": [10_000]}, "must be a whole number from 1 to 9999"),
        (SetAccelerationTimes, {"times_ms": ["1"]}, "must be a whole number from 1 to 9999"),
        (SetSpeedPercent, {"percents": [10.125]}, "must be a number from 0.1 to 100 of at most 5 characters"),
        (SetMaximumSpeeds, {"speeds": [0]}, f"must be a number above 0, up to {LARGEST}, with at most 3"),
        (MoveAbsolute, {"coordinates": [float("nan")]}, f"must be a number from {-LARGEST} to {LARGEST}"),
        (StepAxis, {"axis": "X", "steps": 0}, "must be a whole number from -255 to 255 other than 0"),
        (StepAxis, {"axis": "xy", "steps": 1}, "must be one capital letter, or @ for theta"),
        (RunMacro, {"macro": "pck"}, "must be three capital letters or digits"),
    ],
)
def test_both_ends_of_a_range_are_told_whatever_is_wrong(
    row: Row, parameters: dict[str, object], says: str
) -> None:
    with pytest.raises(ValidationError) as refusal:
        row.model_validate(parameters)
    assert refusal.value.errors()[0]["msg"].startswith(says)


def test_a_range_stands_in_the_schema_as_well() -> None:
    times = SetAccelerationTimes.model_json_schema()["properties"]["times_ms"]
    assert times["items"]["anyOf"][0] == {"type": "integer", "minimum": 1, "maximum": 9999}
