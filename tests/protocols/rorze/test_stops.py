import pytest
from pydantic import ValidationError

from protocols.rorze import stops
from protocols.table import RangeFault, Retry, SyntaxFault
from tests.protocols.rorze.examples import Row, check_examples

CHANGES: list[Row] = [stops.Accelerate, stops.ChangeSpeed, stops.Decelerate]
STOPS: list[Row] = [stops.StopImmediately, stops.StopDecelerating]


@pytest.mark.parametrize(
    "row", [*CHANGES, *STOPS, stops.GetStopSpeedSet, stops.SetStopSpeedSet], ids=lambda row: row.code
)
def test_the_manuals_examples(row: Row) -> None:
    check_examples(row)


@pytest.mark.parametrize("row", STOPS, ids=lambda row: row.code)
def test_a_stop_is_always_allowed_and_may_be_repeated(row: Row) -> None:
    assert row.retry is Retry.STOP
    assert row.modes == "012"
    assert row.moving
    assert row.program
    assert not row.errors


@pytest.mark.parametrize("row", CHANGES, ids=lambda row: row.code)
def test_a_change_of_speed_needs_a_running_move_that_is_no_homing(row: Row) -> None:
    assert row.moving
    assert {0x56, 0x5C} <= row.errors
    assert row.retry is Retry.NEVER


def test_a_speed_lies_between_one_and_a_million() -> None:
    for speed in (1, 1_000_000):
        assert stops.ChangeSpeed(speed=speed).written() == str(speed)
    for speed in (0, 1_000_001):
        with pytest.raises(ValidationError):
            stops.ChangeSpeed(speed=speed)
        with pytest.raises(RangeFault):
            stops.ChangeSpeed.read(str(speed))


def test_a_stop_uses_one_of_thirty_speed_sets_or_that_of_the_move() -> None:
    assert stops.SetStopSpeedSet(speed_set=29).written() == "S[29]"
    assert stops.SetStopSpeedSet.read("").speed_set is None
    with pytest.raises(RangeFault):
        stops.SetStopSpeedSet.read("S[30]")
    with pytest.raises(SyntaxFault):
        stops.SetStopSpeedSet.read("12")


def test_the_speed_set_is_answered_in_one_digit_or_two() -> None:
    asked = stops.GetStopSpeedSet()
    assert [asked.read_reply(text).speed_set for text in ("S[5]", "S[05]", "")] == [5, 5, None]
    with pytest.raises(RangeFault):
        asked.read_reply("S[30]")
    with pytest.raises(SyntaxFault):
        asked.read_reply("S[]")
