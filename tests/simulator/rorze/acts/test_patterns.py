"""Acceleration patterns and speed changes set before a move."""

import pytest

from protocols.rorze import patterns
from tests.simulator.rorze.bench import Bench, examples


@pytest.fixture
def bench() -> Bench:
    """Pattern 17 of 13.3.4: up with set 12, down with set 0; pattern 3 as the examples have it."""
    bench = Bench()
    for number, values in ((12, (5_000, 50_000, 70_000, 30, 30)), (0, (50, 50_000, 95_000, 50, 20))):
        for code, value in zip(("OLS", "OHS", "OSS", "OAS", "OBS"), values, strict=True):
            bench.sent(f"{code}S[{number}],{value}")
    bench.sent("SPSA[17],A:S[12],D:S[0]", "SPSA[3],A:S[12],D:S[12]")
    return bench


def set_deceleration_high(bench: Bench, high: int) -> None:
    bench.sent(f"OHSS[0],{high}")


@pytest.mark.parametrize(("high", "pulses"), [(50_000, 17_778), (40_000, 11_383), (60_000, 25_594)])
def test_the_pulse_counts_of_the_manual(bench: Bench, high: int, pulses: int) -> None:
    """13.3.5 prints these figures."""
    set_deceleration_high(bench, high)
    assert bench.send("SSDA[17]") == f"A:25236,D:{pulses}"


def test_the_move_of_the_manual_decelerates_at_its_pulse(bench: Bench) -> None:
    """13.3.5: of 50,000 pulses the last 17,778 are the deceleration."""
    bench.sent("1+MA[17],50000")
    train = bench.axis.motor.train
    assert train is not None
    assert train.profile.brake_at == 32_222
    assert bench.until_end() == ("1+M", 0)
    assert bench.position() == 50_000


def test_examples_of_settings(bench: Bench) -> None:
    for row in (patterns.SetPattern, patterns.SetSpeedChange):
        for text, reply in examples(row):
            assert bench.send(text) == reply
            for number in (12, 13):
                bench.sent(*(f"{code}S[{number}],50" for code in ("OLS", "OHS", "OSS", "OAS", "OBS")))


def test_pattern_example(bench: Bench) -> None:
    bench.sent("SPSA[3],A:S[12],D:S[13]")
    ((text, reply),) = examples(patterns.GetPattern)
    assert bench.send(text) == reply
    assert bench.send("SPD") == "A:S[30],D:S[30]"


def test_speed_change_example_without_data(bench: Bench) -> None:
    _, (text, reply) = examples(patterns.GetSpeedChange)
    assert bench.send(text) == reply


def test_a_change_is_answered_with_both_its_ends(bench: Bench) -> None:
    pulses = int(bench.send("SHDA[3],50000,3000"))
    bench.sent("SESA[3],2,F50000,S3000")
    assert bench.send("SEDA[3],2") == f"F50000,T{50_000 + pulses},S3000"
    bench.sent("SESA[3],2,T90000,S3000")
    assert bench.send("SEDA[3],2") == f"F{90_000 - pulses},T90000,S3000"
    bench.sent("SESA[3]")
    assert bench.send("SEDA[3],2") == "NoData"


def test_pulses_of_a_speed_change(bench: Bench) -> None:
    assert bench.send("SHDA[17],5000,50000") == "25236"
    assert bench.send("SHDA[17],50000,50") == "17778"
    assert bench.send("SHDA[17],500,500") == "0"
    assert int(bench.send("SHD50,50000")) > 0


def test_changes_that_overlap_are_refused_where_pulses_are_asked_for(bench: Bench) -> None:
    bench.sent("SESA[17],0,F10,S3000")
    assert (bench.send("SSDA[17]"), bench.send("SEDA[17],0")) == ("@65", "@65")


def test_what_is_not_defined_is_refused(bench: Bench) -> None:
    assert [bench.send(text) for text in ("SPDA[9]", "SSDA[9]", "SHDA[9],5,6", "SESA[9],0,F5,S6")] == [
        "@47"
    ] * 4
    bench.sent("SPSA[9],A:S[8],D:S[8]")
    assert bench.send("SSDA[9]") == "@40"


def test_patterns_are_set_and_read_at_rest_only(bench: Bench) -> None:
    bench.sent("1+MZ")
    texts = ("SPSA[1],A:S[1],D:S[1]", "SPDA[3]", "SSDA[3]", "SHDA[3],5,6", "SESA[3]", "SEDA[3],0")
    assert [bench.send(text) for text in texts] == ["@50"] * 6


@pytest.mark.parametrize(
    "text", ["SPSA[30],A:S[1],D:S[1]", "SPSA[1],A:S[30],D:S[1]", "SESA[3],16,F5,S6", "SHD0,5"]
)
def test_ranges(bench: Bench, text: str) -> None:
    assert bench.send(text) == "@4A"
