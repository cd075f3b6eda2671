from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from protocols.rorze import patterns
from protocols.rorze.patterns import GetSpeedChange, SetPattern, SetSpeedChange, SpeedChangePoint
from protocols.rorze.row import RorzeCommand
from protocols.table import RangeFault, SyntaxFault
from tests.protocols.rorze.examples import check_examples

ROWS: list[type[RorzeCommand[Any]]] = [
    GetSpeedChange,
    SetSpeedChange,
    patterns.GetSpeedChangePulses,
    patterns.GetPattern,
    SetPattern,
    patterns.GetPatternPulses,
]


@pytest.mark.parametrize("row", ROWS)
def test_the_manuals_examples(row: type[RorzeCommand[Any]]) -> None:
    check_examples(row)


@pytest.mark.parametrize("row", ROWS)
def test_patterns_are_dealt_with_at_standstill_and_outside_programs(row: type[RorzeCommand[Any]]) -> None:
    assert (row.modes, row.moving, row.program) == ("012", False, False)


def test_a_speed_change_begins_or_ends_at_a_point() -> None:
    begins = SetSpeedChange(pattern=17, point=1, begin=80_000, speed=50_000)
    ends = SetSpeedChange(pattern=17, point=0, end=78_000, speed=10_000)
    assert begins.written() == "A[17],1,F80000,S50000"
    assert ends.written() == "A[17],0,T78000,S10000"


@pytest.mark.parametrize(
    "incomplete",
    [
        {"pattern": 3, "point": 2},
        {"pattern": 3, "point": 2, "speed": 3000},
        {"pattern": 3, "begin": 50_000, "speed": 3000},
        {"pattern": 3, "point": 2, "begin": 50_000, "end": 60_000, "speed": 3000},
    ],
)
def test_a_speed_change_that_says_too_little_or_too_much_cannot_be_built(incomplete: dict[str, int]) -> None:
    with pytest.raises(ValidationError, match="cannot be written"):
        SetSpeedChange.model_validate(incomplete)


@pytest.mark.parametrize(
    ("row", "inside", "outside"),
    [
        (SetSpeedChange, "A[0],0,F0,S1", "A[30],0,F0,S1"),
        (SetSpeedChange, "A[29],15,F999999999,S1000000", "A[29],16,F999999999,S1000000"),
        (SetSpeedChange, "A[3],2,T999999999,S3000", "A[3],2,T1000000000,S3000"),
        (SetSpeedChange, "A[3],2,T0,S1", "A[3],2,T0,S0"),
        (SetSpeedChange, "A[3],2,T0,S1000000", "A[3],2,T0,S1000001"),
        (patterns.GetSpeedChangePulses, "A[3],1,1000000", "A[3],0,1000000"),
        (patterns.GetSpeedChangePulses, "A[3],1000000,1", "A[3],1000001,1"),
        (SetPattern, "A[29],A:S[0],D:S[29]", "A[29],A:S[0],D:S[30]"),
    ],
)
def test_ranges(row: type[RorzeCommand[Any]], inside: str, outside: str) -> None:
    assert row.read(inside).written() == inside
    with pytest.raises(RangeFault):
        row.read(outside)


def test_a_question_for_the_standard_pattern_leaves_its_number_out() -> None:
    command = patterns.GetPattern()
    assert command.written() == ""
    assert command.read_reply("A:S[30],D:S[30]").written() == "A:S[30],D:S[30]"


def test_setting_the_standard_pattern_is_not_possible() -> None:
    with pytest.raises(SyntaxFault):
        SetPattern.read("A:S[12],D:S[13]")


def test_no_data_is_a_speed_change_without_anything() -> None:
    reply = GetSpeedChange(pattern=3, point=5).read_reply("NoData")
    assert (reply.begin, reply.end, reply.speed) == (None, None, None)


@pytest.mark.parametrize(
    "text", ["", "nodata", "F5321,T8000", "F5321,T8000,S", "F-1,T8000,S5000", "NoData,S5000"]
)
def test_half_a_speed_change_is_no_reply(text: str) -> None:
    with pytest.raises(SyntaxFault):
        SpeedChangePoint.read(text)


@given(
    begin=st.integers(0, 999_999_999),
    end=st.integers(0, 999_999_999),
    speed=st.integers(1, 1_000_000),
)
def test_a_reported_speed_change_reads_back(begin: int, end: int, speed: int) -> None:
    reply = SpeedChangePoint(begin=begin, end=end, speed=speed)
    assert SpeedChangePoint.read(reply.written()) == reply


@given(
    pattern=st.integers(0, 29),
    point=st.integers(0, 15),
    where=st.sampled_from(["begin", "end"]),
    pulses=st.integers(0, 999_999_999),
    speed=st.integers(1, 1_000_000),
)
def test_a_speed_change_reads_back(pattern: int, point: int, where: str, pulses: int, speed: int) -> None:
    values = {"pattern": pattern, "point": point, where: pulses, "speed": speed}
    command = SetSpeedChange.model_validate(values)
    assert SetSpeedChange.read(command.written()) == command
