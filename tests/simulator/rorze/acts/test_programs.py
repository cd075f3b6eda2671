"""A controller without a user program: it runs none, and ending it only stops the motor as asked."""

import pytest

from tests.simulator.rorze.bench import Bench


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_no_program_has_ever_run(bench: Bench) -> None:
    assert bench.send("URD") == "H00"


def test_ending_no_program_leaves_the_motor_alone(bench: Bench) -> None:
    bench.sent("1+M2000", "UES")
    assert bench.until_end() == ("1+M", 0x00)
    assert bench.position() == 2000


@pytest.mark.parametrize("command", ["UES0", "UES1"])
def test_ending_with_a_stop_stops_the_motor(bench: Bench, command: str) -> None:
    bench.sent("1+M200000")
    bench.wait(0.5)
    bench.sent(command)
    assert bench.until_end() == ("1+M", 0x10)
    assert 0 < bench.position() < 200000


def test_ending_with_a_stop_does_nothing_to_a_motor_at_rest(bench: Bench) -> None:
    bench.sent("UES0", "UES1")
    assert bench.position() == 0
    assert bench.send("9MD") == "H00"
