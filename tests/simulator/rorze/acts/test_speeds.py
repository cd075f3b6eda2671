"""The speed parameters."""

from typing import Any

import pytest

from protocols.rorze import speeds
from protocols.rorze.row import RorzeCommand
from tests.simulator.rorze.bench import Bench, examples

Rows = tuple[type[RorzeCommand[Any]], type[RorzeCommand[Any]]]

PAIRS: list[Rows] = [
    (speeds.SetStartSpeed, speeds.GetStartSpeed),
    (speeds.SetMaximumSpeed, speeds.GetMaximumSpeed),
    (speeds.SetMaximumAcceleration, speeds.GetMaximumAcceleration),
    (speeds.SetRisingAccelerationShare, speeds.GetRisingAccelerationShare),
    (speeds.SetFallingAccelerationShare, speeds.GetFallingAccelerationShare),
]


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.mark.parametrize("pair", PAIRS)
def test_examples(bench: Bench, pair: Rows) -> None:
    setting, question = pair
    for text, reply in examples(setting):
        assert bench.send(text) == reply
    for text, reply in examples(question):
        target = f"S[12],{int(reply)}" if "[12]" in text else f"{int(reply)}"
        bench.sent(f"{setting.code}{target}")
        assert bench.send(text) == reply


def test_factory_settings(bench: Bench) -> None:
    """RC-420 manual 18: only set 30 is set."""
    answers = [bench.send(question.code) for _, question in PAIRS]
    assert answers == ["00000050", "00050000", "00100000", "050", "050"]
    assert [bench.send(f"{question.code}S[29]") for _, question in PAIRS] == [
        "00000000",
        "00000000",
        "00000000",
        "000",
        "000",
    ]


def test_sets_are_kept_apart(bench: Bench) -> None:
    bench.sent("OHSS[0],1", "OHSS[29],1000000", "OHS2")
    assert [bench.send(f"OHD{which}") for which in ("S[0]", "S[29]", "")] == [
        "00000001",
        "01000000",
        "00000002",
    ]


@pytest.mark.parametrize("text", ["OLS0", "OLS30001", "OHS1000001", "OSS10000001", "OAS101", "OHSS[30],5"])
def test_ranges(bench: Bench, text: str) -> None:
    assert bench.send(text) == "@4A"


def test_nothing_is_set_on_the_move(bench: Bench) -> None:
    bench.sent("1+MZ")
    assert {bench.send(f"{setting.code}50") for setting, _ in PAIRS} == {"@50"}
    assert bench.send("OHD") == "00050000"
