import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from protocols.rorze import interpolation
from protocols.rorze.interpolation import (
    ConvertCoordinatesToPulses,
    ConvertPulsesToCoordinates,
    GetPathPoint,
    GetPulsesPerTurn,
    MoveToExtensionStart,
    PathPoint,
    PreparePath,
    PulsesPerTurn,
    SetPathPoint,
    SetPulsesPerTurn,
    SetRobotType,
    TurnFinger,
)
from protocols.rorze.notation import PositionReference
from protocols.rorze.row import RorzeCommand
from protocols.table import RangeFault, SyntaxFault
from tests.protocols.rorze.examples import check_examples

ROWS: list[type[RorzeCommand[Any]]] = [
    interpolation.PrepareArmExtension,
    interpolation.PrepareArmRetraction,
    interpolation.GetArmLength,
    interpolation.SetArmLength,
    interpolation.GetDrivenAxis,
    interpolation.SetDrivenAxis,
    GetPathPoint,
    SetPathPoint,
    interpolation.GetFingerLength,
    TurnFinger,
    interpolation.SetFingerLength,
    ConvertPulsesToCoordinates,
    ConvertCoordinatesToPulses,
    interpolation.StartInterpolation,
    PreparePath,
    MoveToExtensionStart,
    interpolation.GetStartPosition,
    interpolation.SetStartPosition,
    interpolation.PrepareFingerRotation,
    interpolation.GetRobotType,
    SetRobotType,
    interpolation.PrepareMoveAlongX,
    interpolation.PrepareMoveAlongY,
    GetPulsesPerTurn,
    SetPulsesPerTurn,
]

BILLION = 1_000_000_000
NUMBERS = st.integers(-BILLION + 1, BILLION - 1)
REFERENCES = st.builds(
    PositionReference, position=st.integers(0, 2047) | st.sampled_from(["next", "previous"])
)
MEASURES = NUMBERS | REFERENCES


@pytest.mark.parametrize("row", ROWS)
def test_the_manuals_examples(row: type[RorzeCommand[Any]]) -> None:
    check_examples(row)


@pytest.mark.parametrize("row", ROWS)
def test_interpolation_needs_standstill_and_a_mode_without_encoder(row: type[RorzeCommand[Any]]) -> None:
    assert (row.modes, row.moving, row.program) == ("02", False, False)


def test_three_rows_move_and_the_preparations_do_not() -> None:
    assert [row.code for row in ROWS if row.starts_motion] == ["HFM", "HMM", "HNM"]


@pytest.mark.parametrize(
    ("row", "inside", "outside"),
    [
        (interpolation.PrepareArmExtension, "A[29],999999999", "A[30],1000"),
        (interpolation.PrepareMoveAlongX, "-999999999", "-1000000000"),
        (interpolation.PrepareMoveAlongY, "P[2047]", "P[2048]"),
        (interpolation.SetArmLength, "1", "0"),
        (interpolation.SetFingerLength, "999999999", "1000000000"),
        (interpolation.SetDrivenAxis, "9", "10"),
        (interpolation.SetStartPosition, "0,-10149", "10,-10149"),
        (GetPathPoint, "H[63],15", "H[64],15"),
        (GetPathPoint, "H[0],0", "H[0],16"),
        (SetPathPoint, "H[3],1,X:-1,Y:-1,R:0", "H[3],1,X:-1,Y:-1,R:-1"),
        (PreparePath, "H[63]", "H[64]"),
        (SetPulsesPerTurn, "0,1.00", "0,0.99"),
        (SetPulsesPerTurn, "9,9999999.99", "9,9999999.991"),
    ],
)
def test_ranges(row: type[RorzeCommand[Any]], inside: str, outside: str) -> None:
    assert row.read(inside).written() == inside
    with pytest.raises(RangeFault):
        row.read(outside)


def test_a_path_point_is_three_numbers_or_the_centre_or_everything_cleared() -> None:
    corner = SetPathPoint(path=3, point=0, x=200_000, y=150_000, radius=50_000)
    assert corner.written() == "H[3],0,X:200000,Y:150000,R:50000"
    assert SetPathPoint(path=3, point=0, place="center").written() == "H[3],0,CENTER"
    assert SetPathPoint(path=3).written() == "H[3]"


@pytest.mark.parametrize(
    "values",
    [
        {"path": 3, "point": 1},
        {"path": 3, "place": "center"},
        {"path": 3, "point": 1, "x": 1, "y": 2},
        {"path": 3, "point": 1, "x": 1, "y": 2, "radius": 0, "place": "center"},
    ],
)
def test_a_path_point_that_says_too_little_or_too_much_cannot_be_built(values: dict[str, object]) -> None:
    with pytest.raises(ValidationError, match="cannot be written"):
        SetPathPoint.model_validate(values)


def test_no_data_is_a_path_point_without_anything() -> None:
    reply = GetPathPoint(path=3, point=1).read_reply("NoData")
    assert reply.model_dump(exclude_none=True) == {}


@pytest.mark.parametrize("text", ["", "X:1,Y:2", "X:1,Y:2,R:-3", "CENTER,", "X:H1,Y:2,R:3", "center"])
def test_half_a_path_point_is_no_reply(text: str) -> None:
    with pytest.raises(SyntaxFault):
        PathPoint.read(text)


def test_the_bare_finger_angle_is_understood_but_not_written() -> None:
    assert TurnFinger.read("90000").written() == "F:90000"
    assert TurnFinger.read("A[4],90000").written() == "A[4],F:90000"
    assert TurnFinger(angle=90_000, pattern=4).written() == "A[4],F:90000"


def test_a_belt_linked_robot_has_two_axes_and_no_finger_angle() -> None:
    command = ConvertCoordinatesToPulses(x=200_000, y=100_000)
    assert command.written() == "X:200000,Y:100000"
    reply = command.read_reply("0:+000001000,1:-000002000")
    assert (reply.axis_0, reply.axis_1, reply.axis_2) == (1000, -2000, None)


def test_positions_to_convert_are_all_given_or_all_taken_from_the_start_positions() -> None:
    assert ConvertPulsesToCoordinates().written() == ""
    with pytest.raises(ValidationError, match="cannot be written"):
        ConvertPulsesToCoordinates(axis_0=1000)


def test_converted_numbers_have_ten_characters() -> None:
    with pytest.raises(SyntaxFault):
        ConvertPulsesToCoordinates().read_reply("X:200000,Y:100000,F:90000")


def test_the_target_of_an_extension_is_a_point_or_a_path() -> None:
    with pytest.raises(ValidationError, match="cannot be written"):
        MoveToExtensionStart(pattern=1, x=100, y=200, path=3)


def test_a_robot_type_is_a_word() -> None:
    assert SetRobotType(robot="two_axes_belt_linked").written() == "1"
    with pytest.raises(ValidationError):
        SetRobotType.model_validate_json('{"robot": 0}')
    with pytest.raises(SyntaxFault):
        SetRobotType.read("2")


@pytest.mark.parametrize(
    ("pulses", "written"),
    [(1, "1.00"), (5000.0, "5000.00"), (121_791.045, "121791.045"), (1.00000001, "1.00000001")],
)
def test_pulses_per_turn_keep_their_decimals(pulses: float, written: str) -> None:
    command = SetPulsesPerTurn(axis=1, pulses=pulses)
    assert command.written() == f"1,{written}"
    assert SetPulsesPerTurn.read(f"1,{written}") == command


@pytest.mark.parametrize("pulses", [math.nan, math.inf, 0.5, 1.000000001, "5000", True])
def test_pulses_per_turn_the_controller_could_not_hold_are_refused(pulses: object) -> None:
    with pytest.raises(ValidationError):
        SetPulsesPerTurn.model_validate({"axis": 1, "pulses": pulses})


def test_pulses_per_turn_always_have_decimals_on_the_wire() -> None:
    with pytest.raises(SyntaxFault):
        SetPulsesPerTurn.read("1,5000")
    with pytest.raises(SyntaxFault):
        GetPulsesPerTurn(axis=1).read_reply("5000.00")


@given(axis=st.integers(0, 9), hundred_millionths=st.integers(10**8, 999_999_999_000_000))
def test_pulses_per_turn_read_back(axis: int, hundred_millionths: int) -> None:
    command = SetPulsesPerTurn(axis=axis, pulses=hundred_millionths / 10**8)
    assert SetPulsesPerTurn.read(command.written()) == command
    reply = interpolation.PulsesPerTurn(pulses=command.pulses)
    assert GetPulsesPerTurn(axis=axis).read_reply(reply.written()) == reply


@given(
    path=st.integers(0, 63),
    point=st.integers(0, 15),
    x=MEASURES,
    y=MEASURES,
    radius=st.integers(0, BILLION - 1) | REFERENCES,
)
def test_a_path_point_reads_back(
    path: int,
    point: int,
    x: int | PositionReference,
    y: int | PositionReference,
    radius: int | PositionReference,
) -> None:
    command = SetPathPoint(path=path, point=point, x=x, y=y, radius=radius)
    assert SetPathPoint.read(command.written()) == command
    assert SetPathPoint.model_validate_json(command.model_dump_json()) == command


@given(x=NUMBERS, y=NUMBERS, radius=st.integers(0, BILLION - 1))
def test_a_reported_path_point_reads_back(x: int, y: int, radius: int) -> None:
    reply = PathPoint(x=x, y=y, radius=radius)
    assert PathPoint.read(reply.written()) == reply


@pytest.mark.parametrize("text", ["5000.0", "5000.00", "60000.000", "121791.04500000", "1.00"])
def test_the_pulses_of_a_turn_keep_their_decimals(text: str) -> None:
    setting = SetPulsesPerTurn.read(f"1,{text}")
    assert setting.written() == f"1,{text}"
    told = PulsesPerTurn(pulses=setting.pulses)
    assert told.written() == text.zfill(8 + 1 + len(text.partition(".")[2]))
    again = PulsesPerTurn.read(told.written())
    assert SetPulsesPerTurn(axis=1, pulses=again.pulses).written() == f"1,{text}"
    assert SetPulsesPerTurn.model_validate_json('{"axis": 1, "pulses": 5000.5}').written() == "1,5000.50"
    assert told.model_dump_json() == f'{{"pulses":{float(text)}}}'
