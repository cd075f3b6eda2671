"""Faults that no command brings about: errors of hardware and of the RS-485 line, settings found wrong."""

import pytest

from protocols.rorze.errors import ERRORS, ErrorKind
from simulator.rorze.breakdowns import INTERNAL_ERRORS, Breakdown
from simulator.rorze.settings import STANDARD
from tests.simulator.rorze.bench import Bench


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_every_error_of_chapter_21_that_is_none_of_a_command_is_internal() -> None:
    assert set(INTERNAL_ERRORS) == {*range(0x10, 0x18), 0x48, 0x4B, 0x4D, 0x4E, 0x4F, 0x53, 0x68}


@pytest.mark.parametrize("code", sorted(INTERNAL_ERRORS))
def test_a_command_that_meets_an_error_is_not_done(bench: Bench, code: int) -> None:
    bench.axis.breakdown = Breakdown(code, 2)
    assert [bench.send("6PS7"), bench.send("1+M500")] == [f"@{code:02X}"] * 2
    assert not bench.axis.motor.moving
    assert bench.position() == 0


@pytest.mark.parametrize("code", sorted(INTERNAL_ERRORS))
def test_an_error_of_the_line_is_told_by_bit_7_until_it_is_cleared(bench: Bench, code: int) -> None:
    """13.8.2."""
    bench.axis.breakdown = Breakdown(code, 1)
    bench.send("6PD")
    assert bench.send("9CD") == ("H80" if ERRORS[code].kind is ErrorKind.COMMUNICATION else "H00")
    bench.sent("9CS")
    assert bench.send("9CD") == "H00"


def test_an_error_reports_itself_as_an_event(bench: Bench) -> None:
    bench.sent("EMSC:H80", "ESSC")
    bench.axis.breakdown = Breakdown(0x4B, 1)
    bench.send("6PD")
    [message] = bench.axis.take_messages()
    assert message.frame.fields == {"C": 0x80}  # type: ignore[union-attr]  # no move has ended


def test_a_running_move_goes_on(bench: Bench) -> None:
    bench.sent("2+M100")
    bench.axis.breakdown = Breakdown(0x4E, 1)
    assert bench.send("5IS") == "@4E"
    assert bench.until_end() == ("2+M", 0)
    assert bench.position() == 100


def test_settings_found_wrong_at_power_on_are_told_by_bit_4_until_it_is_cleared(bench: Bench) -> None:
    """13.8.2; that the defaults hold then is an assumption."""
    bench.sent("OLS700", "FIS")
    bench.axis.flash.damaged = True
    bench.axis.power_off(bench.now)
    bench.axis.power_on(bench.now)
    assert (bench.send("9CD"), bench.send("9CD4")) == ("H10", "1")
    assert bench.axis.settings.speeds[STANDARD].low == 50
    bench.sent("9CS")
    assert bench.send("9CD") == "H00"


@pytest.mark.parametrize("mended", ["FIS", "FES Init"])
def test_writing_or_erasing_the_settings_makes_them_right(bench: Bench, mended: str) -> None:
    bench.axis.flash.damaged = True
    bench.sent(mended)
    bench.axis.power_off(bench.now)
    bench.axis.power_on(bench.now)
    assert bench.send("9CD") == "H00"
