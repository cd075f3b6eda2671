"""A robot at a dual-port RAM, in virtual time: where it lies, and how long a message may lie in it."""

import asyncio
import functools
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest

from commissioning.findings import Result
from commissioning.report import Report
from commissioning.run import commission
from gateway.config import parse
from gateway.config_file import changed
from simulator.fics.dpram_port import SimulatedDpram, serve_dpram
from tests.commissioning.benches import QUESTIONS, fics, result_of, unlike
from tests.virtual_time import run_virtual

LINE = """
[[lines]]
id = "cell"
address = "dpram://{path}?stuck_ms=150"
protocol = "fics"
late_reply_s = 0.3
[lines.robot]
id = "r1"
[[lines.robot.units]]
number = 1
axes = ["X", "Y", "Z"]
"""
SLOW_S = 0.2

TURN_S = 0.0002
"""Seconds of a turn of the loop: both sides of the RAM look at it in each."""


@pytest.fixture(autouse=True)
def _virtual_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("simulator.ports.monotonic", lambda: asyncio.get_running_loop().time())


def in_turns(story: Callable[..., Coroutine[None, None, None]]) -> Callable[..., None]:
    """Run a story in virtual time that goes on while the loop is awake."""

    @functools.wraps(story)
    def told(**fixtures: Any) -> None:
        run_virtual(story(**fixtures), TURN_S)

    return told


async def commissioned(text: str) -> Report:
    line: Any = parse(text, "gateway.toml").lines[0]
    return await commission(line, QUESTIONS)


def served(path: Path, takes_after_s: float = 0.0) -> SimulatedDpram:
    ram = serve_dpram(fics(), path)
    ram.takes_after_s = takes_after_s
    return ram


@in_turns
async def test_a_robot_that_answers_there_agrees(tmp_path: Path) -> None:
    ram = served(tmp_path / "ram")
    report = await commissioned(LINE.format(path=tmp_path / "ram"))
    await ram.aclose()
    assert unlike(report) == {}
    assert result_of(report, "dpram-map").result is Result.AGREES
    assert result_of(report, "dpram-times").result is Result.AGREES


@in_turns
async def test_a_robot_that_takes_its_time_gets_it(tmp_path: Path) -> None:
    text = LINE.format(path=tmp_path / "ram")
    ram = served(tmp_path / "ram", SLOW_S)
    report = await commissioned(text)
    assert result_of(report, "dpram-times").result is Result.DIFFERS
    after = changed(text, "cell", report.changes(), "gateway.toml")
    assert "stuck_ms=6" in after
    again = await commissioned(after)
    await ram.aclose()
    assert unlike(again) == {}


@in_turns
async def test_a_robot_that_takes_nothing_is_told_as_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("commissioning.run.STUCK_MS", 200)
    ram = served(tmp_path / "ram")
    ram.stalled = True
    report = await commissioned(LINE.format(path=tmp_path / "ram"))
    await ram.aclose()
    assert report.lost
    assert report.lost in report.markdown()
    assert {it.result for it in report.results} == {Result.CANNOT_TELL}
    assert report.frames
