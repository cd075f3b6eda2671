"""The outputs of an RC-420: levels, pulses over them, and the outputs that tell of errors."""

import pytest

from simulator.rorze.outputs import ALL_OUTPUTS, CLEAR, OUTPUTS, Outputs
from simulator.rorze.settings import ErrorOutput
from tests.simulator.rorze.bench import Bench

SERVO = 2


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def outputs(bench: Bench) -> Outputs:
    return bench.axis.io.outputs


def test_a_pulse_shows_and_what_is_steady_stays_below_it(outputs: Outputs) -> None:
    outputs.set(3, True)
    outputs.pulse(3, False, 20, now=0.0)
    outputs.pulse(5, True, 10, now=0.0)
    assert (outputs.bits(), outputs.steady) == (1 << 5, 1 << 3)
    outputs.advance(0.010)
    assert (outputs.pulsing(5), outputs.pulsing(3)) == (False, True)
    outputs.advance(0.020)
    assert outputs.bits() == outputs.steady == 1 << 3


def test_the_next_end_of_a_pulse_is_known(outputs: Outputs) -> None:
    assert outputs.wake_at() is None
    outputs.pulse(1, True, 300, now=1.0)
    outputs.pulse(2, True, 100, now=1.0)
    assert outputs.wake_at() == pytest.approx(1.1)
    outputs.advance(1.15)
    assert outputs.wake_at() == pytest.approx(1.3)


def test_all_outputs_are_set_at_once_and_pulses_end_with_it(outputs: Outputs) -> None:
    outputs.pulse(7, True, 1000, now=0.0)
    outputs.set_all(0x0F0F)
    assert outputs.bits() == outputs.steady == 0x0F0F
    assert outputs.wake_at() is None
    outputs.set_all(ALL_OUTPUTS)
    assert outputs.bits() == ALL_OUTPUTS


@pytest.mark.parametrize(("mode", "absent"), [(0, CLEAR), (1, CLEAR), (SERVO, 0)])
def test_one_place_is_the_clear_signals_or_output_0s(
    bench: Bench, outputs: Outputs, mode: int, absent: int
) -> None:
    bench.settings(mode=mode)
    assert [place for place in range(OUTPUTS + 1) if not outputs.available(place)] == [absent]
    outputs.set(absent, True)
    outputs.pulse(absent, True, 1000, now=0.0)
    assert not outputs.level(absent)


def test_the_clear_signal_is_no_general_output(bench: Bench, outputs: Outputs) -> None:
    bench.settings(mode=SERVO)
    outputs.set(CLEAR, True)
    assert outputs.clear_signal()
    assert outputs.bits() == outputs.steady == 0


def test_a_cause_without_an_output_drives_none(outputs: Outputs) -> None:
    outputs.error("stall")
    assert outputs.bits() == 0
    assert not outputs.driven("stall")
    assert not outputs.holding()


def test_an_error_drives_its_own_output_and_that_of_every_error(bench: Bench, outputs: Outputs) -> None:
    bench.settings(
        error_outputs={"limit": ErrorOutput(2, 1), "any": ErrorOutput(3, 0), "ems": ErrorOutput(4, 1)}
    )
    outputs.set(3, True)
    outputs.error("limit")
    assert outputs.bits() == 1 << 2
    assert [outputs.driven(cause) for cause in ("limit", "any", "ems")] == [True, True, False]
    assert outputs.holding()


def test_a_release_turns_only_what_an_error_has_driven(bench: Bench, outputs: Outputs) -> None:
    bench.settings(error_outputs={"limit": ErrorOutput(2, 1), "ems": ErrorOutput(4, 0)})
    outputs.error("limit")
    outputs.release_errors()
    assert outputs.bits() == 0
    assert not outputs.holding()
    outputs.set(2, True)
    outputs.release_errors()
    assert outputs.bits() == 1 << 2


def test_an_error_output_changed_meanwhile_is_released_as_it_was_driven(
    bench: Bench, outputs: Outputs
) -> None:
    bench.settings(error_outputs={"ems": ErrorOutput(2, 1)})
    outputs.error("ems")
    bench.settings(error_outputs={"ems": ErrorOutput(9, 0)})
    outputs.release_errors()
    assert outputs.bits() == 0
