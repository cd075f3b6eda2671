"""The commands `status` and `watch` and their output."""

import json
from collections.abc import Iterator
from contextlib import contextmanager

import httpx
import pytest
from typer.testing import CliRunner, Result

from app import http
from app.cli import app
from app.commands import watch
from tests.app.fake_gateway import Answer, FakeGateway, plant

BODY = {
    "body_id": "a.3F",
    "name": "arm",
    "online": True,
    "moving": True,
    "position": -250,
    "power_cycled": False,
    "status": ["pulses_running", "limit_error", "ems_error"],
}
UNITS = [{"number": 1, "axes": [{"name": "X"}, {"name": "@"}]}]
ROBOT = {"robot_id": "r1", "name": "", "online": True, "moving": None, "missing_units": [2], "units": UNITS}
SCARA = {
    "scara_id": "wafer",
    "name": "hand",
    "online": True,
    "moving": False,
    "power_cycled": False,
    "axes": [{"body_id": "a.02"}, {"body_id": "a.3F"}],
}
STATUS: dict[str, list[Answer]] = {
    "/lines": [
        (
            200,
            {"lines": [{"line_id": "a", "state": "down", "address": "tcp://x:1", "down_reason": "gone"}]},
        )
    ],
    "/bodies": [
        (200, {"bodies": [BODY, {**BODY, "body_id": "a.02", "name": "", "online": False, "status": None}]})
    ],
    "/scaras": [(200, {"scaras": [SCARA]})],
    "/robots": [(200, {"robots": [{**ROBOT, "power_cycled": True, "error": {"code": "101"}}]})],
}


def test_status_is_a_table(monkeypatch: pytest.MonkeyPatch) -> None:
    said = FakeGateway(dict(STATUS)).run(monkeypatch, "status")
    assert said.exit_code == 0, said.output
    assert said.stdout.splitlines() == [
        "LINE  STATE  ADDRESS    TROUBLE",
        "a     down   tcp://x:1  gone",
        "",
        "BODY  NAME  STATE    POSITION  NOTE",
        "a.3F  arm   moving   -250      limit error; ems error",
        "a.02        offline  -250",
        "",
        "SCARA  NAME  STATE     AXES        NOTE",
        "wafer  hand  standing  a.02, a.3F",
        "",
        "ROBOT  NAME  STATE      UNITS  NOTE",
        "r1           not known  1: X@  has lost its power; error 101; no unit 2",
    ]


def test_status_as_json(monkeypatch: pytest.MonkeyPatch) -> None:
    said = FakeGateway(dict(STATUS)).run(monkeypatch, "status", "--json")
    assert json.loads(said.stdout)["bodies"][0] == BODY


# events


def event(number: int) -> str:
    told = {
        "time": "2026-01-02T03:04:05Z",
        "type": "body.move.succeeded",
        "subject": "/bodies/a.3F",
        "data": {"status": "succeeded", "position": number, "end_cause": None},
    }
    return f"id: e-{number}\nevent: body.move.succeeded\ndata: {json.dumps(told)}\n\n"


class FakeStream:
    """Connections in turn: what each delivers, or why there is none."""

    def __init__(self, *connections: str | Exception | int) -> None:
        self._connections = list(connections)
        self.resumed: list[str | None] = []
        self.queries: list[dict[str, str]] = []

    @contextmanager
    def stream(
        self,
        _method: str,
        _url: str,
        *,
        params: dict[str, str],
        headers: dict[str, str],
        **_: object,
    ) -> Iterator[httpx.Response]:
        self.resumed.append(headers.get("Last-Event-ID"))
        self.queries.append(params)
        now = self._connections.pop(0)
        if isinstance(now, Exception):
            raise now
        if isinstance(now, int):
            yield httpx.Response(now, json={"detail": "No."})
        else:
            yield httpx.Response(200, text=now)

    def watch(self, monkeypatch: pytest.MonkeyPatch, *words: str) -> Result:
        monkeypatch.setattr(http, "stream", self.stream)
        monkeypatch.setattr(http, "request", FakeGateway(plant(b3F="arm")).request)
        monkeypatch.setattr(watch, "TRY_AGAIN_S", 0.0)
        return CliRunner().invoke(app, ["watch", *words])


def test_each_event_is_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    said = FakeStream(": events after e-0\n\n" + event(1) + ": still here\n\n").watch(
        monkeypatch, "--count", "1"
    )
    assert said.exit_code == 0, said.output
    assert said.stdout == (
        "2026-01-02T03:04:05Z  body.move.succeeded  /bodies/a.3F  status=succeeded  position=1\n"
    )


def test_a_text_may_hold_what_unicode_calls_an_end_of_line(monkeypatch: pytest.MonkeyPatch) -> None:
    odd = event(1).replace('succeeded", "pos', 'a\u2028b\u0085c", "pos')
    said = FakeStream(odd).watch(monkeypatch, "--count", "1", "--json")
    assert said.exit_code == 0, said.output
    assert json.loads(said.stdout)["data"]["status"] == "a\u2028b\u0085c"


def test_after_a_break_none_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = FakeStream(
        ": events after e-0\n\n",
        http.AnswerLost("gone"),
        http.NotReached("refused"),
        503,
        event(1) + event(2),
        event(3),
    )
    said = stream.watch(monkeypatch, "--count", "3", "--json")
    assert said.exit_code == 0, said.output
    assert [json.loads(line)["data"]["position"] for line in said.stdout.splitlines()] == [1, 2, 3]
    assert stream.resumed == [None, "e-0", "e-0", "e-0", "e-0", "e-2"]
    assert said.stderr.count("is lost; it is tried again") == 1


def test_filters_take_names_and_the_beginning_a_cursor(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = FakeStream(event(8))
    words = ("--bodies", "arm,02,r1/units/1", "--types", "body.*", "--after", "e-7", "--count", "1")
    assert stream.watch(monkeypatch, *words).exit_code == 0
    assert stream.queries == [{"types": "body.*", "bodies": "a.3F,02,r1/units/1"}]
    assert stream.resumed == ["e-7"]


def test_live_values_are_lines_too(monkeypatch: pytest.MonkeyPatch) -> None:
    known = {"time": "2026-01-02T03:04:05Z", "type": "body.position", "subject": "/bodies/a.3F"}
    told = {**known, "data": {"pulses": 500, "value": 0.5, "unit": "mm"}}
    stream = FakeStream(f"id: e-8\nevent: body.position\ndata: {json.dumps(told)}\n\n")
    said = stream.watch(monkeypatch, "--sample", "5", "--count", "1")
    assert stream.queries == [{"sample": "5"}]
    assert said.stdout.strip().endswith("pulses=500  value=0.5")


@pytest.mark.parametrize(("beginning", "code"), [(http.NotReached("refused"), 3), (403, 1), (422, 2)])
def test_what_cannot_begin_is_told(
    beginning: Exception | int, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert FakeStream(beginning).watch(monkeypatch).exit_code == code


def test_interrupting_it_is_no_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(http, "stream", interrupted)
    assert CliRunner().invoke(app, ["watch"]).exit_code == 0
