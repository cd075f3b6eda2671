"""The position table and its index."""

from typing import Any

import pytest

from protocols.rorze import position_table as rows
from protocols.rorze.row import RorzeCommand
from tests.simulator.rorze.bench import Bench, examples


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.mark.parametrize(
    "row",
    [
        rows.AddToPositionEntry,
        rows.SubtractFromPositionEntry,
        rows.MultiplyPositionEntry,
        rows.DividePositionEntry,
        rows.ClearPositionEntries,
        rows.SetPositionIndex,
        rows.GetPositionEntry,
        rows.GetNumberedPositionEntry,
        rows.SetPositionEntry,
    ],
)
def test_examples(bench: Bench, row: type[RorzeCommand[Any]]) -> None:
    bench.sent("3PSP[25],50")
    for text, reply in examples(row):
        bench.sent("3IS25")
        assert bench.send(text) == reply


def test_index_example(bench: Bench) -> None:
    bench.sent("3IS50")
    assert [(bench.send(text), reply) for text, reply in examples(rows.GetPositionIndex)] == [("0050",) * 2]


def test_filling_the_table_upwards_to_its_end(bench: Bench) -> None:
    """13.4.3."""
    bench.sent("3IS2045", "3PSP[+],100", "3PSP[+],20000", "3PSP[+],30000")
    assert bench.send("3PSP[+],40000") == "@5D"
    assert [int(bench.send(f"3PDP[{number}]")) for number in (2045, 2046, 2047)] == [100, 20_000, 30_000]
    assert bench.send("3ID") == "@5D"
    bench.sent("3IS3", "3PSP[-],1")
    assert bench.send("3ID") == "0002"


def test_sums_on_entries(bench: Bench) -> None:
    bench.sent("3PSP[1],100", "3+SP[1],50", "3*SP[1],-3", "3-SP[1],-10", "3/SP[1],-7")
    assert bench.send("3NDP[1]") == "P[0001],+000000062"


@pytest.mark.parametrize("text", ["3+SP[1],1", "3*SP[1],2", "3-SP[1],-1"])
def test_a_result_that_does_not_fit_changes_nothing(bench: Bench, text: str) -> None:
    bench.sent("3PSP[1],999999999")
    assert bench.send(text) == "@5D"
    assert bench.send("3PDP[1]") == "+999999999"


def test_an_entry_takes_the_present_position(bench: Bench) -> None:
    bench.sent("6PS-1234", "3PSP[9]")
    assert bench.send("3PDP[9]") == "-000001234"


def test_clearing(bench: Bench) -> None:
    bench.sent("3PSP[0],5", "3PSP[2047],6", "3CS")
    assert (bench.send("3PDP[0]"), bench.send("3PDP[2047]")) == ("+000000000",) * 2


@pytest.mark.parametrize("text", ["3PSP[2048],1", "3IS2048", "3/SP[1],0", "3PDP", "3PSP[1],1000000000"])
def test_refusals(bench: Bench, text: str) -> None:
    assert bench.send(text) in {"@4A", "@5D"}
