"""`motion-gateway jog`: it jogs while the program runs, and no longer."""

import json
import time
from typing import Any

import pytest
from typer.testing import Result

from app import http
from tests.app.fake_gateway import Answer, FakeGateway, interrupted_at, plant

GONE = http.NotReached("refused")


def jog(state: str) -> dict[str, Any]:
    return {"id": "j1", "state": state, "heartbeat_within_ms": 750}


def gateway(path: str, *ends: str, beat: Answer = (200, {})) -> FakeGateway:
    """Where something jogs, and what each stop answers."""
    told: dict[str, list[Answer]] = {
        f"{path}/jogs": [(201, jog("jogging"))],
        f"{path}/jogs/j1/heartbeat": [beat],
        f"{path}/jogs/j1/stop": [(200, jog(end)) for end in ends] or [(0, GONE)],
    }
    return FakeGateway(plant(b3F="lift") | told)


def held(monkeypatch: pytest.MonkeyPatch, asked: FakeGateway, *words: str) -> Result:
    """Hold it for three heartbeats, and press Ctrl-C."""
    pauses = interrupted_at(monkeypatch, 4)
    said = asked.run(monkeypatch, "jog", *words)
    assert set(pauses[:4]) <= {0.25}, "three heartbeats in the time in which one has to come"
    return said


def test_it_jogs_with_heartbeats_until_ctrl_c_and_standstill_is_waited_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = gateway("/bodies/a.3F", "stopping", "stopping", "ended")
    said = held(monkeypatch, asked, "lift", "-", "--speed", "high", "--at-most", "5", "--unit", "mm")
    assert said.exit_code == 0, said.output
    assert json.loads(said.stdout)["state"] == "ended"
    wanted = {"direction": "-", "speed": "high", "at_most": {"value": 5.0, "unit": "mm"}}
    jogs = "/bodies/a.3F/jogs"
    beats, stops = [(f"{jogs}/j1/heartbeat", None)] * 3, [(f"{jogs}/j1/stop", None)] * 3
    assert asked.posted == [(jogs, wanted), *beats, *stops]


def test_an_axis_of_a_robot_jogs_too(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = gateway("/robots/r1", "ended")
    assert held(monkeypatch, asked, "r1/units/2", "x-").exit_code == 0
    assert asked.posted[0] == ("/robots/r1/jogs", {"unit": 2, "axis": "X", "direction": "-"})


@pytest.mark.parametrize(
    ("ends", "code", "sentence"),
    [
        (("ended",), 0, ""),
        (("stopped",), 1, "Somebody else"),
        (("lost",), 1, "no heartbeat came in time"),
        ((), 4, "No heartbeat follows: the gateway stops it itself within half a second."),
    ],
)
def test_a_jog_that_goes_on_no_more_is_told_as_it_has_ended(
    monkeypatch: pytest.MonkeyPatch, ends: tuple[str, ...], code: int, sentence: str
) -> None:
    over: Answer = (409, {"detail": "The JOG is over.", "moved": "yes"})
    said = held(monkeypatch, gateway("/bodies/3F", *ends, beat=over), "3F", "cw")
    assert said.exit_code == code
    assert sentence in said.stderr


def test_standstill_that_is_not_seen_in_time_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(range(0, 1000, 3))
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    said = held(monkeypatch, gateway("/bodies/3F", "stopping"), "3F", "cw")
    assert said.exit_code == 4
    assert "Use the hardware stop" in said.stderr


@pytest.mark.parametrize(
    "words", [("3F", "up"), ("80", "+"), ("r1", "X+"), ("r1/1", "X"), ("r1/1", "X+", "--speed", "low")]
)
def test_what_does_not_jog_is_told_before_anything_is_sent(
    monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    asked = gateway("/bodies/3F", "ended")
    said = asked.run(monkeypatch, "jog", *words)
    assert said.exit_code == 2
    assert "Nothing was sent." in said.stderr
    assert asked.posted == []
