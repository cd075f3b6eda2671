"""Status bits, end causes, version and comments."""

import pytest

from protocols.rorze import status
from simulator.rorze.acts.status import VERSION
from simulator.rorze.world import EMS
from tests.simulator.rorze.bench import Bench, examples


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_status_examples(bench: Bench) -> None:
    (one_bit, at_rest), (all_bits, moving) = examples(status.GetControllerStatus)
    assert bench.send(one_bit) == at_rest
    bench.sent("1+MZ")
    assert bench.send(all_bits) == moving


def test_other_examples(bench: Bench) -> None:
    for row in (status.ClearControllerStatus, status.GetEndCause, status.SetUserComment):
        for text, reply in examples(row):
            assert bench.send(text) == reply


def test_version_and_comments(bench: Bench) -> None:
    bench.axis.execute("9VS2,Serial No.00000152", bench.now)
    (version, _), (comment, text) = examples(status.GetInformation)
    assert bench.send(version) == VERSION
    assert (bench.send(comment), bench.send("9VD1")) == ("Serial No.00000152", "")
    assert text.replace(" ", "") == "SerialNo.00000152"


def test_errors_stay_until_they_are_cleared(bench: Bench) -> None:
    bench.force(EMS, True)
    assert bench.send("1+M5") == "@51"
    bench.force(EMS, False)
    bench.sent("1+M5")
    bench.until_end()
    assert (bench.send("9CD"), bench.send("9CD3"), bench.send("9CD2")) == ("H08", "1", "0")
    bench.sent("9CS")
    assert bench.send("9CD") == "H00"


def test_the_end_cause_is_cleared_by_the_next_move(bench: Bench) -> None:
    bench.sent("1+MZ", "5IS")
    assert bench.send("9MD") == "H10"
    bench.sent("1+M5")
    assert bench.send("9MD") == "H00"


@pytest.mark.parametrize("text", ["9CD8", "9CDX", "9VD0", "9VD8", "9VS8,x", "9VS1", "9CS1"])
def test_refusals(bench: Bench, text: str) -> None:
    assert bench.send(text) == "@4A"
