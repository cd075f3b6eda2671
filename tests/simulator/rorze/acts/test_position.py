"""The position and encoder counters."""

from typing import Any

import pytest

from protocols.rorze import position
from protocols.rorze.row import RorzeCommand
from tests.simulator.rorze.bench import Bench, examples


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.mark.parametrize(
    ("row", "first"),
    [
        (position.GetPosition, "6PS50000"),
        (position.SetPosition, ""),
        (position.GetEncoderCount, "6ES50000"),
        (position.SetEncoderCount, ""),
        (position.GetEncoderPosition, "6ES50000"),
    ],
)
def test_examples(bench: Bench, row: type[RorzeCommand[Any]], first: str) -> None:
    if first:
        bench.sent(first)
    for text, reply in examples(row):
        assert bench.send(text) == reply


def test_setting_the_position_moves_nothing(bench: Bench) -> None:
    bench.sent("2+M100")
    bench.until_end()
    bench.sent("6PS-999999999")
    assert (bench.send("6PD"), bench.shaft()) == ("-999999999", 100)
    assert bench.send("6ED") == "+000000100", "the encoder counter is left alone"


def test_counters_are_not_set_on_the_move(bench: Bench) -> None:
    bench.sent("1+MZ")
    assert (bench.send("6PS0"), bench.send("6ES0")) == ("@50", "@50")


def test_the_counters_take_each_other_over(bench: Bench) -> None:
    """6PSC multiplies by the PBS ratio, 6ESP divides by it."""
    bench.settings(encoder_ratio=2.5)
    bench.sent("6ES40", "6PSC")
    assert bench.send("6PD") == "+000000100"
    bench.sent("6PS1000", "6ESP")
    assert (bench.send("6ED"), bench.send("6MD")) == ("+000000400", "+000001000")


def test_in_encoder_mode_both_are_set(bench: Bench) -> None:
    bench.settings(encoder_ratio=2.5, mode=1)
    bench.sent("6PS40")
    assert (bench.send("6PD"), bench.send("6ED"), bench.send("6MD")) == (
        "+000000040",
        "+000000040",
        "+000000100",
    )
    bench.settings(mode=0)
    assert bench.send("6PD") == "+000000100"


def test_the_encoder_sees_what_the_shaft_does(bench: Bench) -> None:
    bench.sent("2+M100")
    bench.until_end()
    bench.axis.world.slipped = 30
    assert (bench.send("6PD"), bench.send("6ED")) == ("+000000100", "+000000070")


def test_registers_hold_nine_digits(bench: Bench) -> None:
    bench.settings(encoder_ratio=100.0)
    bench.sent("6ES999999999")
    assert bench.send("6MD") == "+999999999"


@pytest.mark.parametrize("text", ["6PS1000000000", "6PS", "6PSX", "6ES5.0", "6PD0"])
def test_refusals(bench: Bench, text: str) -> None:
    assert bench.send(text) == "@4A"
