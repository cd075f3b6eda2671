"""Software stops and speed changes on the way."""

from typing import Any

import pytest

from protocols.rorze import stops
from protocols.rorze.profile import SpeedParameters, ramp_pulses
from protocols.rorze.row import RorzeCommand
from tests.simulator.rorze.bench import Bench, examples

STANDARD = SpeedParameters(50, 50_000, 100_000, 50, 50)


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def running(bench: Bench) -> Bench:
    """An endless move at its full speed of 50,000 pps."""
    bench.sent("1+MZ")
    bench.wait(1.5)
    return bench


def speed(bench: Bench) -> float:
    train = bench.axis.motor.train
    return 0.0 if train is None else train.speed(bench.now)


@pytest.mark.parametrize("row", [stops.Accelerate, stops.ChangeSpeed, stops.Decelerate])
def test_examples_of_speed_changes(running: Bench, row: type[RorzeCommand[Any]]) -> None:
    for text, reply in examples(row):
        assert running.send(text) == reply


@pytest.mark.parametrize("row", [stops.StopImmediately, stops.StopDecelerating])
def test_examples_of_stops(running: Bench, row: type[RorzeCommand[Any]]) -> None:
    for text, reply in examples(row):
        assert running.send(text) == reply


def test_examples_of_the_stop_speed_set(bench: Bench) -> None:
    (chosen, accepted), (own, _) = examples(stops.SetStopSpeedSet)
    (question, twelve), (_, nothing) = examples(stops.GetStopSpeedSet)
    assert bench.send(question) == nothing
    assert (bench.send(chosen), bench.send(question)) == (accepted, twelve)
    assert (bench.send(own), bench.send(question)) == (accepted, nothing)


def test_5is_stops_between_two_pulses(running: Bench) -> None:
    there = running.position()
    running.sent("5IS")
    (ended,) = running.ends()
    assert (ended.body, ended.code, ended.cause) == (0x3F, "1+M", 0x10)
    running.wait(10)
    assert running.position() == there
    assert (running.send("9MD"), running.send("9CD")) == ("H10", "H00")


def test_5ss_runs_out_over_the_ramp(running: Bench) -> None:
    there = running.position()
    running.sent("5SS")
    assert running.send("9MD") == "H00", "nothing has ended yet"
    assert running.until_end() == ("1+M", 0x10)
    assert running.position() == there + ramp_pulses(STANDARD, 50_000, 50)


def test_5ms_chooses_the_ramp_of_stops(running: Bench) -> None:
    steep = SpeedParameters(500, 50_000, 1_000_000, 20, 20)
    running.sent("5IS", "OLSS[12],500", "OHSS[12],50000", "OSSS[12],1000000", "OASS[12],20", "OBSS[12],20")
    running.ends()
    running.sent("5MSS[12]", "1+MZ")
    running.wait(1.5)
    there = running.position()
    running.sent("5SS")
    running.until_end()
    assert running.position() == there + ramp_pulses(steep, 50_000, 500)


def test_a_stop_set_that_is_not_complete_never_prevents_a_stop(bench: Bench) -> None:
    bench.sent("5MSS[7]", "1+MZ")
    bench.wait(1)
    bench.sent("5SS")
    assert bench.until_end() == ("1+M", 0x10)


def test_5ss_in_a_low_speed_move_stops_at_once(bench: Bench) -> None:
    bench.sent("2+MZ")
    bench.wait(1)
    bench.sent("5SS")
    assert bench.ends()[0].cause == 0x10
    assert bench.position() == 50


def test_5is_cuts_a_5ss_short(running: Bench) -> None:
    running.sent("5SS")
    running.wait(0.1)
    there = running.position()
    running.sent("5IS")
    assert [ended.cause for ended in running.ends()] == [0x10]
    assert running.position() == there


def test_stops_at_rest_do_nothing(bench: Bench) -> None:
    bench.sent("5IS", "5SS")
    assert bench.ends() == []
    assert bench.send("9MD") == "H00"


def test_speed_changes_at_rest_are_refused(bench: Bench) -> None:
    assert [bench.send(text) for text in ("5AS", "5CS500", "5DS")] == ["@56"] * 3


def test_speed_goes_where_it_is_told(running: Bench) -> None:
    speeds = []
    for text in ("5CS20000", "5AS", "5DS", "5CS30000"):
        running.sent(text)
        running.wait(3)
        speeds.append(round(speed(running)))
    assert speeds == [20_000, 50_000, 50, 30_000]


def test_a_changed_speed_leaves_the_target_alone(bench: Bench) -> None:
    bench.sent("1+M200000")
    bench.wait(1.5)
    bench.sent("5CS20000")
    bench.wait(1)
    bench.sent("5AS")
    assert bench.until_end() == ("1+M", 0)
    assert bench.position() == 200_000


def test_5ms_waits_for_standstill(running: Bench) -> None:
    assert running.send("5MSS[1]") == "@50"
