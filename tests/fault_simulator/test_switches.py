"""With any safety rule switched off something fails: the tests see what they claim to see."""

import asyncio
import logging
from pathlib import Path

import pytest

from tests import virtual_time
from tests.drawing import drawn
from tests.fault_simulator.seed import run
from tests.fault_simulator.switches import STORIES, SWITCHES, Switch, Told
from tests.virtual_time import NeverEnds, run_virtual

LONGEST_S = 600.0
MOST_TURNS = 5_000
"""A story without its rule may never end: then it has failed."""


def seen(seed: int, *, by_replay: bool = False) -> bool:
    """Say whether a seed shows that something is wrong."""
    try:
        report = run(seed)
        return bool(report.violations) or (by_replay and report.digest != run(seed, jumps=False).digest)
    except (Exception, pytest.fail.Exception):
        return True


# An engine that breaks may leave behind what it had begun.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")


@pytest.mark.parametrize("switch", drawn(SWITCHES, 2, "switches"), ids=lambda switch: switch.rule)
def test_the_fault_simulator_sees_that_a_rule_is_off(
    switch: Switch, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.CRITICAL, "gateway")
    switch.off(monkeypatch)
    assert any(seen(seed, by_replay=switch.by_replay) for seed in switch.seeds), switch.rule


@pytest.fixture
def bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(virtual_time, "LONGEST_S", LONGEST_S)
    monkeypatch.setattr(virtual_time, "MOST_TURNS", MOST_TURNS)


@pytest.mark.usefixtures("bounds")
@pytest.mark.parametrize("told", STORIES, ids=lambda told: told.off.__name__)
def test_a_story_sees_that_a_rule_is_off(told: Told, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    told.story(monkeypatch, tmp_path / "with the rule")
    told.off(monkeypatch)
    with pytest.raises((Exception, pytest.fail.Exception)):  # any failure will do
        told.story(monkeypatch, tmp_path / "without")


@pytest.mark.usefixtures("bounds")
@pytest.mark.parametrize("pause_s", [0.0, 1.0])
def test_a_story_that_never_ends_has_failed(pause_s: float) -> None:
    async def story() -> None:
        while True:  # noqa: ASYNC110  # no event
            await asyncio.sleep(pause_s)

    with pytest.raises(NeverEnds, match="It is not over after"):
        run_virtual(story())


def test_there_are_25_switches() -> None:
    assert len(SWITCHES) + len(STORIES) >= 25
