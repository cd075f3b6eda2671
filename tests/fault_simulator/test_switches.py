"""With any safety rule switched off something fails: the tests see what they claim to see."""

import logging
from pathlib import Path

import pytest

from tests.fault_simulator.seed import run
from tests.fault_simulator.switches import STORIES, SWITCHES, Switch, Told


def seen(seed: int) -> bool:
    """Whether a seed shows that something is wrong."""
    try:
        return bool(run(seed).violations)
    except (Exception, pytest.fail.Exception):
        return True


# An engine that breaks may leave behind what it had begun.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")


@pytest.mark.parametrize("switch", SWITCHES, ids=lambda switch: switch.off.__name__)
def test_the_fault_simulator_sees_that_a_rule_is_off(
    switch: Switch, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.CRITICAL, "gateway")
    switch.off(monkeypatch)
    assert any(map(seen, switch.seeds)), switch.rule


@pytest.mark.parametrize("told", STORIES, ids=lambda told: told.off.__name__)
def test_a_story_sees_that_a_rule_is_off(told: Told, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    told.story(monkeypatch, tmp_path / "with the rule")
    told.off(monkeypatch)
    with pytest.raises((Exception, pytest.fail.Exception)):  # any failure will do
        told.story(monkeypatch, tmp_path / "without")


def test_there_are_25_switches() -> None:
    assert len(SWITCHES) + len(STORIES) >= 25
