"""Moves: where they go, how they get there, and what refuses them."""

from typing import Any

import pytest

from protocols.rorze import moves
from protocols.rorze.profile import SpeedParameters, plan
from protocols.rorze.row import RorzeCommand
from simulator.rorze.controller import StallFinder
from simulator.rorze.world import CCW_LIMIT, CW_LIMIT, EMS
from tests.simulator.rorze.bench import Bench, examples

ROWS = (
    moves.MoveClockwise,
    moves.MoveCounterclockwise,
    moves.MoveTo,
    moves.MoveClockwiseSlowly,
    moves.MoveCounterclockwiseSlowly,
    moves.MoveToSlowly,
)
CODES = [row.code for row in ROWS]
STANDARD = SpeedParameters(50, 50_000, 100_000, 50, 50)


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.machine(origin=(-20, -10), ccw=(-2_000_000, -1_900_000), cw=(1_900_000, 2_000_000))
    return bench


@pytest.mark.parametrize("row", ROWS)
def test_examples(bench: Bench, row: type[RorzeCommand[Any]]) -> None:
    bench.sent("3PSP[50],700", "3IS50", "OLSS[3],50", "OHSS[3],5000", "OSSS[3],100000")
    bench.sent("OASS[3],50", "OBSS[3],50", "SPSA[3],A:S[3],D:S[3]")
    for text, reply in examples(row):
        bench.sent("3IS50")
        assert bench.send(text) == reply
        bench.sent("5IS")


def test_a_move_runs_to_its_last_pulse_and_reports_its_end(bench: Bench) -> None:
    """13.2.2: the reply comes at once, the end of the move when it ends."""
    bench.sent("1+M50000")
    assert bench.send("9CD") == "H01"
    assert bench.until_end() == ("1+M", 0)
    assert (bench.position(), bench.send("9CD"), bench.send("9MD")) == (50_000, "H00", "H00")


def test_positions_on_the_way_lie_on_the_curve(bench: Bench) -> None:
    profile = plan(50_000, STANDARD, STANDARD)
    bench.sent("1-M50000")
    assert profile.duration_s is not None
    while bench.axis.motor.moving:
        assert bench.position() == -profile.emitted(bench.now)
        bench.wait(0.037)
    assert bench.now >= profile.duration_s
    assert bench.position() == -50_000


def test_the_end_comes_at_the_planned_moment(bench: Bench) -> None:
    bench.sent("1+M5000")
    bench.until_end()
    assert bench.now == pytest.approx(plan(5_000, STANDARD, STANDARD).duration_s)


def test_there_and_back_as_the_sample_program_does(bench: Bench) -> None:
    """17.2: its four moves lead back to where they began."""
    for text, expected in (("1+M2000", 2_000), ("1-M2000", 0), ("1+M1000", 1_000), ("1-M1000", 0)):
        bench.sent(text)
        assert bench.until_end() == (text[:3], 0)
        assert bench.position() == expected


def test_absolute_moves_go_either_way(bench: Bench) -> None:
    for text, expected in (("1AM500", 500), ("1AM-300", -300), ("2AM0", 0), ("1AMH1F", 31)):
        bench.sent(text)
        assert bench.until_end() == (text[:3], 0)
        assert bench.position() == expected


@pytest.mark.parametrize("code", ["1AM", "2AM"])
def test_a_move_to_where_it_is_ends_at_once(bench: Bench, code: str) -> None:
    bench.sent(f"{code}0")
    assert bench.until_end() == (code, 0)
    assert bench.now == 0
    assert bench.truth.of("pulses_start") == []


def test_low_speed_moves_run_at_ol_without_ramps(bench: Bench) -> None:
    bench.sent("OLS200", "2+M1000")
    bench.wait(2.5)
    assert bench.position() == 500
    bench.until_end()
    assert bench.now == pytest.approx(5.0)


def test_endless_moves_end_only_by_command(bench: Bench) -> None:
    bench.sent("2-MZ")
    bench.wait(100)
    assert bench.position() == -5_000
    bench.sent("5IS")
    assert bench.ends()[0].cause == 0x10


def test_the_table_holds_distances_and_places(bench: Bench) -> None:
    """13.4.2."""
    bench.sent("3PSP[12],30000", "1+MP[12]")
    assert bench.until_end() == ("1+M", 0)
    bench.sent("1+MP[12]")
    bench.until_end()
    assert bench.position() == 60_000
    bench.sent("1AMP[12]")
    bench.until_end()
    assert bench.position() == 30_000


def test_the_index_steps_down_to_the_end_of_the_table(bench: Bench) -> None:
    """13.4.3: entries 2, 1 and 0, then 5D until the index is set again."""
    bench.sent("3PSP[0],1", "3PSP[1],10", "3PSP[2],100", "3IS2")
    for expected in (100, 110, 111):
        bench.sent("1+MP[-]")
        bench.until_end()
        assert bench.position() == expected
    assert bench.send("1+MP[-]") == "@5D"
    bench.sent("3IS0", "1+MP[+]")
    assert bench.send("3ID") == "0001"


def test_a_refused_move_does_not_step_the_index(bench: Bench) -> None:
    bench.sent("3IS7")
    assert bench.send("1+MP[+]") == "@5D", "entry 7 is 0, which is no distance"
    bench.force(EMS, True)
    assert bench.send("1AMP[+]") == "@51"
    assert bench.send("3ID") == "0007"


# Refusals


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("1+M0", "@5D"),
        ("1+M1000000000", "@5D"),
        ("1AM-1000000000", "@5D"),
        ("1+MA[30],5", "@5D"),
        ("1+MP[2048]", "@5D"),
        ("1+M", "@4A"),
        ("1+M5.5", "@4A"),
        ("1+MA[3]5", "@4A"),
        ("1AMZ", "@4A"),
        ("1+X5", "@49"),
    ],
)
def test_wrong_parameters(bench: Bench, text: str, code: str) -> None:
    assert bench.send(text) == code
    assert not bench.axis.motor.moving
    assert bench.send("9CD") == "H08"


def test_patterns_and_speeds_must_be_complete(bench: Bench) -> None:
    refusals = [bench.send("1+MA[1],5")]
    bench.sent("SPSA[1],A:S[1],D:S[2]")
    for setting in ("OLSS[1],700", "OHSS[1],600", "OSSS[1],5000", "OASS[1],60", "OBSS[1],50", "OHSS[1],900"):
        refusals.append(bench.send("1+MA[1],5"))
        bench.sent(setting)
    refusals.append(bench.send("1+MA[1],5"))
    bench.sent("OBSS[1],40")
    refusals.append(bench.send("1+MA[1],5"))
    assert refusals == ["@47", "@40", "@41", "@42", "@43", "@44", "@45", "@46", "@40"]
    bench.sent("SPSA[1],A:S[1],D:S[1]", "1+MA[1],5")


@pytest.mark.parametrize("code", CODES)
def test_no_second_move_while_one_runs(bench: Bench, code: str) -> None:
    bench.sent("1+MZ")
    assert bench.send(f"{code}5") == "@50"


@pytest.mark.parametrize("code", CODES)
def test_ems_and_stall_refuse_every_move(bench: Bench, code: str) -> None:
    bench.axis.stalls.add(StallFinder.SENSOR)
    assert bench.send(f"{code}5") == "@52"
    bench.force(EMS, True)
    assert bench.send(f"{code}5") == "@51"


def test_a_limit_refuses_the_way_on_but_not_the_way_back(bench: Bench) -> None:
    bench.force(CW_LIMIT, True)
    assert bench.send("1+M5") == "@55"
    bench.sent("1-M5")
    bench.until_end()
    bench.force(CW_LIMIT, False)
    bench.force(CCW_LIMIT, True)
    assert (bench.send("2AM-10"), bench.send("2AM0")) == ("@55", "")


def test_the_movable_range_is_a_fence(bench: Bench) -> None:
    bench.settings(movable_range=(-500, 500))
    assert [bench.send(text) for text in ("1+M501", "1-M501", "1AM501", "2AM-501")] == ["@5D"] * 4
    bench.sent("1+M500")
    bench.until_end()
    assert bench.send("1+MZ") == "@5D"
    assert bench.send("9CD") == "H08"


def test_an_endless_move_that_leaves_the_range_is_marked(bench: Bench) -> None:
    bench.settings(movable_range=(-500, 500))
    bench.sent("2+MZ")
    bench.wait(10.01)
    assert (bench.position(), bench.send("9CD")) == (500, "H01")
    bench.wait(0.02)
    assert (bench.position(), bench.send("9CD")) == (501, "H21")
    bench.sent("5IS", "9CS")
    assert bench.send("9CD") == "H00"


def test_a_move_of_a_billion_pulses_is_too_far(bench: Bench) -> None:
    bench.sent("6PS-600000000")
    assert bench.send("1AM600000000") == "@5E"


def test_the_register_ends_at_a_billion(bench: Bench) -> None:
    bench.sent("6PS999999990")
    assert bench.send("1+M10") == "@5D"
    bench.sent("1+MZ")
    assert bench.until_end() == ("1+M", 0)
    assert bench.position() == 999_999_999
    assert bench.send("1+MZ") == "@5D"


# Limits and EMS on the way


@pytest.mark.parametrize(("code", "cause", "place"), [("1+M", 0x02, 40_000), ("1-M", 0x04, -30_000)])
def test_a_limit_stops_at_its_very_pulse(bench: Bench, code: str, cause: int, place: int) -> None:
    bench.machine(origin=(0, 5), ccw=(-31_000, -30_000), cw=(40_000, 41_000))
    bench.sent(f"{code}100000")
    assert bench.until_end() == (code, cause)
    assert bench.position() == place
    assert (bench.send("9CD"), bench.send("9MD")) == ("H02", f"H{cause:02X}")
    assert bench.send(f"{code}5") == "@55"


def test_a_limit_at_the_last_pulse_still_counts(bench: Bench) -> None:
    bench.machine(origin=(0, 5), ccw=(-31_000, -30_000), cw=(40_000, 41_000))
    bench.sent("1+M40000")
    assert bench.until_end() == ("1+M", 0x02)


def test_a_limit_behind_does_not_stop(bench: Bench) -> None:
    bench.sent("2+M1000")
    bench.wait(1)
    bench.force(CCW_LIMIT, True)
    assert bench.until_end() == ("2+M", 0)


def test_ems_stops_at_once_and_clears_with_9cs(bench: Bench) -> None:
    bench.sent("1+M50000")
    bench.wait(0.5)
    there = bench.position()
    bench.force(EMS, True)
    assert bench.position() == there
    assert bench.ends()[0].cause == 0x08
    assert (bench.send("9CD"), bench.send("9MD")) == ("H04", "H08")
    bench.force(EMS, False)
    bench.sent("9CS", "1+M5")
    assert (bench.send("9CD"), bench.send("9MD")) == ("H01", "H00")


def test_speed_changes_set_before_the_move(bench: Bench) -> None:
    """13.3.7: slowly past pulse 79,000, at full speed on both sides of it."""
    bench.sent("OLSS[1],50", "OHSS[1],50000", "OSSS[1],100000", "OASS[1],50", "OBSS[1],50")
    bench.sent("SPSA[17],A:S[1],D:S[1]", "SESA[17],0,T78000,S10000", "SESA[17],1,F80000,S50000")
    bench.sent("1+MA[17],150000")
    train = bench.axis.motor.train
    assert train is not None
    speeds = [train.speed(at) for pulses in (50_000, 79_000, 110_000) if (at := train.time_when(pulses))]
    assert speeds == pytest.approx([50_000, 10_000, 50_000])
    assert bench.until_end() == ("1+M", 0)


@pytest.mark.parametrize("code", CODES)
def test_speed_changes_that_do_not_suit_refuse_the_move(bench: Bench, code: str) -> None:
    """13.3.7: commands 1 and 2."""
    bench.sent("OLSS[1],50", "OHSS[1],50000", "OSSS[1],100000", "OASS[1],50", "OBSS[1],50")
    bench.sent("SPSA[17],A:S[1],D:S[1]", "SESA[17],0,F78000,S10000")
    assert bench.send(f"{code}A[17],150000") == "@62"
    bench.sent("SESA[17],1,F80000,S50000")
    assert bench.send(f"{code}A[17],150000") == "@65"
    bench.sent("SESA[17]", f"{code}A[17],150000")


def test_a_low_speed_move_makes_no_speed_changes(bench: Bench) -> None:
    bench.sent("OLSS[1],500", "OHSS[1],50000", "OSSS[1],100000", "OASS[1],50", "OBSS[1],50")
    bench.sent("SPSA[17],A:S[1],D:S[1]", "SESA[17],0,F30000,S10000", "SESA[17],1,F60000,S50000")
    bench.sent("2+MA[17],150000")
    assert bench.until_end() == ("2+M", 0)
    assert bench.now == pytest.approx(150_000 / 500)


def test_encoder_mode_counts_by_the_encoder(bench: Bench) -> None:
    """13.1.3: distances are encoder counts, speeds stay in pulses."""
    bench.axis.world.encoder = 10.0
    bench.settings(mode=1, encoder_ratio=2.5)
    bench.sent("2+M100")
    assert bench.until_end() == ("2+M", 0)
    assert bench.now == pytest.approx(250 / 50)
    assert (bench.position(), bench.send("6ED"), bench.send("6MD")) == (100, "+000000100", "+000000250")
    bench.sent("1AM-40")
    bench.until_end()
    assert (bench.position(), bench.shaft()) == (-40, -100)
