"""A thousand seeds: whatever goes wrong, what clients are told is true, and nothing is done twice."""

import logging

import pytest

from tests.drawing import drawn
from tests.fault_simulator.seed import COMMANDS, run

SEEDS = 1_000
TOGETHER = 10
DRAWN = 60
"""Seeds that run in `make test`."""
FAULTS_PER_SEED = 40
CRASHES_PER_SEED = 2
REPLAYED = range(20)


@pytest.fixture(autouse=True)
def _quiet(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.CRITICAL, "gateway")


@pytest.mark.parametrize("first", drawn(range(0, SEEDS, TOGETHER), DRAWN // TOGETHER, "seeds"))
def test_whatever_goes_wrong_what_is_told_is_true(first: int) -> None:
    reports = {seed: run(seed) for seed in range(first, first + TOGETHER)}
    assert {seed: report.violations for seed, report in reports.items() if report.violations} == {}
    assert sum(report.wanted for report in reports.values()) >= COMMANDS * TOGETHER
    assert sum(report.faults for report in reports.values()) >= FAULTS_PER_SEED * TOGETHER
    assert sum(report.crashes for report in reports.values()) >= CRASHES_PER_SEED * TOGETHER


@pytest.mark.parametrize("seed", drawn(REPLAYED, 2, "replayed"))
def test_a_seed_sends_the_same_again_whatever_the_wall_clock_does(seed: int) -> None:
    assert run(seed).digest == run(seed, jumps=False).digest
