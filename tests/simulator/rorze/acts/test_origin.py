"""Homing, seen from the machine: where the shaft ends up, and which way it went."""

from typing import Any

import pytest

from protocols.rorze import origin
from protocols.rorze.row import RorzeCommand
from simulator.rorze.world import CCW_LIMIT, CW_LIMIT, EMS, ORIGIN, STALL, Slits
from tests.simulator.rorze.bench import Bench, examples

SEARCHES = (
    origin.Home,
    origin.HomeFastThenStop,
    origin.HomeFastThenDecelerate,
    origin.HomeLikeRc204,
)
DOG = (1_000, 1_199)
CW_EDGE = 1_199


@pytest.fixture
def bench() -> Bench:
    """A short axis: dog, limits, and a disc with the middle of a slit at 1,100."""
    bench = Bench()
    bench.machine(origin=DOG, ccw=(-500, -400), cw=(5_000, 5_100))
    bench.axis.world.slits = Slits(1_050, 200)
    return bench


def turns(bench: Bench) -> list[int]:
    """Where the legs of the last move began and ended, as the shaft stands."""
    slipped = bench.axis.world.slipped
    starts = bench.truth.of("pulses_start")
    stops = bench.truth.of("pulses_stop")
    places = [int(str(starts[0].facts["at"]))] + [int(str(stop.facts["at"])) for stop in stops]
    return [place - slipped for place in places]


@pytest.mark.parametrize("start", [3_000, CW_EDGE + 1, 5_050, 6_000])
def test_from_the_cw_side_it_goes_straight_to_the_edge_and_the_offset_beyond(
    bench: Bench, start: int
) -> None:
    """Cases 1, 4 and 6 of 13.5.2: CW of the dog, on the CW limit, and beyond it."""
    bench.place(start)
    bench.sent("00M")
    assert bench.until_end() == ("00M", 0)
    assert turns(bench) == [start, CW_EDGE, CW_EDGE - 10]
    assert bench.position() == 0
    assert bench.send("0PD") == f"{start - CW_EDGE + 10:+010d}"


def test_on_the_dog_it_leaves_overruns_and_enters_again(bench: Bench) -> None:
    """Case 2: the overrun is offset times factor."""
    bench.place(1_100)
    bench.sent("0SS15", "0BS3", "00M")
    assert bench.until_end() == ("00M", 0)
    assert turns(bench) == [1_100, CW_EDGE + 1, CW_EDGE + 46, CW_EDGE, CW_EDGE - 15]
    assert bench.position() == 0


def test_from_the_ccw_side_it_turns_at_the_ccw_limit(bench: Bench) -> None:
    """Case 3: CCW to the limit, CW past the dog, and back into it."""
    bench.place(500)
    bench.sent("00M")
    assert bench.until_end() == ("00M", 0)
    assert turns(bench) == [500, -400, 1_000, CW_EDGE + 1, CW_EDGE + 21, CW_EDGE, CW_EDGE - 10]
    assert bench.send("9CD") == "H00"


def test_on_the_ccw_limit_it_starts_cw(bench: Bench) -> None:
    """Case 5."""
    bench.place(-450)
    bench.sent("00M")
    assert bench.until_end() == ("00M", 0)
    assert turns(bench)[:2] == [-450, 1_000]
    assert bench.shaft() == CW_EDGE - 10


def test_beyond_the_ccw_limit_it_never_finds_the_origin(bench: Bench) -> None:
    """Case 7 cannot be searched: it goes away from everything until it is stopped."""
    bench.place(-600)
    bench.sent("00M")
    bench.wait(3_600)
    assert bench.axis.motor.moving
    assert bench.shaft() == -600 - 3_600 * 50
    bench.sent("5IS")
    assert bench.until_end() == ("00M", 0x10)
    assert bench.position() == -3_600 * 50, "a stopped search does not set the origin"


def test_slow_search_keeps_to_the_start_speed_of_set_30(bench: Bench) -> None:
    bench.place(CW_EDGE + 100)
    bench.sent("OLS200", "00M")
    bench.until_end()
    assert bench.now == pytest.approx(110 / 200)


@pytest.mark.parametrize("code", ["02M", "03M"])
@pytest.mark.parametrize("start", [4_500, 1_100, 300, -450])
def test_fast_searches_end_at_the_same_place_sooner(bench: Bench, code: str, start: int) -> None:
    bench.place(start)
    bench.sent("OHS2000", "OSS20000", code)
    assert bench.until_end() == (code, 0)
    assert (bench.shaft(), bench.position()) == (CW_EDGE - 10, 0)
    assert bench.now < abs(start - CW_EDGE) / 50 + 20


def test_02m_stops_on_the_edge_and_03m_after_its_ramp(bench: Bench) -> None:
    first_stops = {}
    for code in ("02M", "03M"):
        bench = Bench()
        bench.machine(origin=DOG, ccw=(-500, -400), cw=(5_000, 5_100))
        bench.place(4_500)
        bench.sent("OHS2000", "OSS20000", code)
        bench.until_end()
        first_stops[code] = turns(bench)[1]
    assert first_stops["02M"] == CW_EDGE
    assert first_stops["03M"] < CW_EDGE


@pytest.mark.parametrize("start", [3_000, 1_100, 500])
def test_04m_ends_on_the_cw_side_of_the_dog(bench: Bench, start: int) -> None:
    bench.place(start)
    bench.sent("04M")
    assert bench.until_end() == ("04M", 0)
    assert bench.shaft() == CW_EDGE + 1 + 10
    assert bench.position() == 0


def test_without_a_dog_the_search_fails_at_the_cw_limit(bench: Bench) -> None:
    bench.force(ORIGIN, False)
    bench.place(500)
    bench.sent("00M")
    assert bench.until_end() == ("00M", 0x02)
    assert turns(bench) == [500, -400, 5_000]
    assert bench.send("9CD") == "H02"
    assert bench.send("0PD") == "+000000000"


def test_retries_start_over_after_the_limit(bench: Bench) -> None:
    bench.force(ORIGIN, False)
    bench.place(500)
    bench.sent("0RS2", "00M")
    assert bench.until_end() == ("00M", 0x02)
    assert turns(bench) == [500, -400, 5_000, -400, 5_000, -400, 5_000]


def test_a_retry_may_find_what_was_missed(bench: Bench) -> None:
    bench.force(ORIGIN, False)
    bench.place(4_500)
    bench.sent("OLS5000", "OHS5000", "0RS1", "00M")
    bench.wait(2.0)
    del bench.axis.world.forced[ORIGIN]
    bench.axis.sense(bench.now)
    assert bench.until_end() == ("00M", 0)
    assert bench.shaft() == CW_EDGE - 10


def test_ems_ends_a_search_for_good(bench: Bench) -> None:
    bench.place(3_000)
    bench.sent("0RS9", "00M")
    bench.wait(1)
    bench.force(EMS, True)
    assert bench.ends()[0].cause == 0x08
    assert bench.send("9CD") == "H04"
    assert bench.send("00M") == "@51"


def test_speed_cannot_be_changed_while_searching(bench: Bench) -> None:
    bench.place(3_000)
    bench.sent("00M")
    assert [bench.send(text) for text in ("5AS", "5CS100", "5DS", "00M")] == ["@5C", "@5C", "@5C", "@50"]


def test_a_decelerating_stop_ends_a_slow_search_at_once(bench: Bench) -> None:
    bench.place(3_000)
    bench.sent("00M")
    bench.wait(1)
    bench.sent("5SS")
    assert bench.ends()[0].cause == 0x10
    assert bench.shaft() == 2_950


def test_bad_speeds_refuse_the_search(bench: Bench) -> None:
    bench.sent("OLS1000", "OHS500")
    assert [bench.send(row.code) for row in SEARCHES] == ["@45"] * 4
    bench.sent("OHS5000", "OAS60", "OBS50")
    assert bench.send("00M") == "@46"


# The STALL disc


def test_the_middle_of_the_slit_becomes_the_origin(bench: Bench) -> None:
    bench.place(1_120)
    bench.sent("0QM")
    assert bench.until_end() == ("0QM", 0)
    assert turns(bench) == [1_120, 1_150, 1_149, 1_049, 1_099]
    assert bench.position() == 0
    assert bench.send("0PD") == "+000000021"


def test_centring_needs_a_covered_sensor_and_free_limits(bench: Bench) -> None:
    bench.place(1_160)
    assert bench.send("0QM") == "@52"
    bench.place(1_100)
    bench.force(CCW_LIMIT, True)
    assert bench.send("0QM") == "@55"
    bench.force(EMS, True)
    assert bench.send("0QM") == "@51"


def test_a_sensor_that_never_opens_is_a_stall_error(bench: Bench) -> None:
    bench.force(STALL, True)
    bench.place(1_100)
    bench.sent("0QM")
    assert bench.until_end() == ("0QM", 0x01)
    assert bench.shaft() == 1_100 + 2_048
    assert bench.send("1+M10") == "@52"
    assert bench.send("9CD") == "H48", "STALL, and the refused command"
    bench.sent("9CS")
    assert bench.send("9CD") == "H40", "9CS leaves the STALL error"


def test_01m_searches_and_centres(bench: Bench) -> None:
    assert bench.send("01M") == "@54"
    bench.settings(stall_detection=1, stall_interval=200)
    bench.axis.world.slits = Slits(1_150, 200)
    bench.place(1_500)
    bench.sent("01M")
    assert bench.until_end() == ("01M", 0)
    assert bench.shaft() == 1_199
    assert bench.position() == 0


def test_01m_fails_where_the_sensor_is_open_at_the_origin(bench: Bench) -> None:
    bench.settings(stall_detection=1)
    bench.axis.world.slits = Slits(1_190, 2_048)
    bench.place(1_500)
    bench.sent("01M")
    assert bench.until_end() == ("01M", 0x01)
    assert bench.send("01M") == "@52"
    bench.sent("00M")
    assert bench.until_end() == ("00M", 0)
    assert bench.send("9CD") == "H08", "a successful search ends the STALL error"


def test_slipping_is_noticed_at_the_next_middle(bench: Bench) -> None:
    """13.6.2: with detection on, each move compares the sensor in the middle of every slit and gap."""
    bench.settings(stall_detection=1, stall_interval=200)
    bench.place(1_120)
    bench.sent("0QM")
    bench.until_end()
    bench.sent("1+M1000")
    assert bench.until_end() == ("1+M", 0)
    bench.axis.world.slipped += 100
    bench.sent("1+M1000")
    assert bench.until_end() == ("1+M", 0x01)
    assert bench.position() == 1_100
    assert bench.send("1-M10") == "@52"


def test_limits_stop_no_search_in_the_other_direction(bench: Bench) -> None:
    bench.place(3_000)
    bench.force(CW_LIMIT, True)
    bench.sent("00M")
    assert bench.until_end() == ("00M", 0)


# Settings


@pytest.mark.parametrize(
    ("row", "first"),
    [
        (origin.GetOverrunFactor, "0BS2"),
        (origin.SetOverrunFactor, ""),
        (origin.GetHomingRetries, "0RS2"),
        (origin.SetHomingRetries, ""),
        (origin.GetOriginOffset, "0SS20"),
        (origin.SetOriginOffset, ""),
        *((search, "") for search in SEARCHES),
    ],
)
def test_examples(bench: Bench, row: type[RorzeCommand[Any]], first: str) -> None:
    for text, reply in examples(row):
        if first:
            bench.sent(first)
        assert bench.send(text) == reply


def test_homing_distance_example(bench: Bench) -> None:
    bench.place(CW_EDGE - 10 + 10_000)
    bench.sent("OLS30000", "00M")
    bench.until_end()
    ((text, reply),) = examples(origin.GetHomingDistance)
    assert bench.send(text) == reply


def test_factory_settings_and_ranges(bench: Bench) -> None:
    assert [bench.send(text) for text in ("0BD", "0RD", "0SD")] == ["2", "0", "00010"]
    assert [bench.send(text) for text in ("0BS6", "0RS10", "0SS0", "0SS65536", "0SS")] == ["@4A"] * 5
