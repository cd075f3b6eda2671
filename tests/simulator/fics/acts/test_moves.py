"""Refusals of a move's start, and the speed of a step."""

import pytest

from simulator.fics.acts.moves import HAND_PERCENT
from tests.simulator.fics.bench import Bench, cartesian


@pytest.mark.parametrize("command", ["LMI ,,1", "LMA ,,1", "MMI ,,1", "JTE Z1"])
@pytest.mark.parametrize("trouble", ["driver_error", "silent"])
def test_an_axis_whose_driver_cannot_move_is_refused_and_stands(command: str, trouble: str) -> None:
    bench = Bench()
    bench.home()
    place = bench.motor("Z").at
    setattr(bench.motor("Z"), trouble, True)
    assert bench.do(command) == [f"{command[:3]} E02"]
    assert bench.motor("Z").at == place


def test_the_trouble_of_one_driver_keeps_no_other_axis_back() -> None:
    bench = Bench(cartesian())
    bench.motor("@").driver_error = 0xF0
    assert bench.do("LMI 1") == ["LMI"]
    assert bench.do("LMI 1,1") == ["LMI E02"]


@pytest.mark.parametrize("command", ["LMI ,,0.5", "MMI ,,0.5", "LMA ,,-7.5", "MMA ,,-7.5"])
def test_there_are_no_fractions_of_a_pulse(command: str) -> None:
    bench = Bench(cartesian())
    bench.home()
    assert bench.do(command) == [f"{command[:3]} E05"]
    assert bench.do(command.replace(".5", "")) == [command[:3]]


@pytest.mark.parametrize(("command", "ok"), [("LMA", False), ("MMA", False), ("LMI", True), ("MMI", True)])
def test_only_a_move_by_an_amount_needs_no_origin(command: str, ok: bool) -> None:
    bench = Bench(cartesian())
    assert bench.do(f"{command} 1") == [command if ok else f"{command} E10"]


def test_an_axis_that_is_left_out_needs_no_origin() -> None:
    bench = Bench(cartesian())
    bench.motor("Z").homed = True
    assert bench.do("LMA 1") == ["LMA"]
    assert bench.do("LMA ,1") == ["LMA E10"]


def test_a_step_is_as_slow_as_a_hand_and_heeds_no_percentage() -> None:
    def seconds(*texts: str) -> float:
        bench = Bench(cartesian())
        bench.asked("VST 1,1,1", "VSS 1,1,1", *texts[:-1])
        began = bench.now
        assert bench.do(texts[-1]) == [texts[-1][:3]]
        return bench.now - began

    hand_speed = Bench(cartesian()).motor("Z").top_speed * HAND_PERCENT / 100
    expected_s = pytest.approx(2.55 / hand_speed, rel=0.02)
    assert seconds("JTE Z255") == expected_s
    assert seconds("VAO 1", "JTE Z255") == expected_s
    assert seconds("LMI 2.55") != expected_s
