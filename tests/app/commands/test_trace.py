"""`motion-gateway trace`: what was said on a line, and what is."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import httpx
import pytest

from app import http
from app.commands import watch
from tests.app.fake_gateway import FakeGateway, always

SENT = {
    "at": "2026-01-02T03:04:05Z",
    "monotonic_ns": 1,
    "kind": "tx",
    "data": "&3F6PD\\r",
    "caller": "http 127.0.0.1",
    "request_id": "job-17",
}
HEARD = {**SENT, "kind": "rx", "data": ">&3F6PD+00000000\\r", "caller": None, "request_id": None}
LOST = {**HEARD, "kind": "lost", "data": ""}


def test_an_answer_stands_behind_its_question_with_what_they_mean_and_who_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = always({"entries": [SENT, HEARD, LOST]})
    said = asked.run(monkeypatch, "trace", "arm", "--bodies", "3F", "--request", "job-17", "--last", "3")
    assert said.exit_code == 0, said.output
    assert said.stdout.splitlines() == [
        "2026-01-02T03:04:05Z  ->  &3F6PD\\r  <-  >&3F6PD+00000000\\r  get the present position: 0"
        "  http 127.0.0.1  job-17",
        "2026-01-02T03:04:05Z  lost",
    ]
    assert asked.paths == ["/lines/arm/trace"]


POLLED = {**SENT, "data": "&009CD\\r", "caller": "gateway: poll", "request_id": None}


def test_what_the_gateway_asks_by_itself_is_shown_where_it_is_wanted(monkeypatch: pytest.MonkeyPatch) -> None:
    told = always({"entries": [POLLED, {**HEARD, "data": ">&009CDH08\\r"}]})
    shown = told.run(monkeypatch, "trace", "arm", "--all").stdout
    assert "get the controller status: command error  gateway: poll" in shown
    assert [request.query for request in told.asked] == [{"polls": "true", "limit": "200"}]


def test_the_newest_lines_are_counted_as_they_are_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    told = always({"entries": [SENT, HEARD, LOST, SENT, HEARD, SENT, HEARD]})
    said = told.run(monkeypatch, "trace", "arm", "--last", "3")
    assert [line.split()[1] for line in said.stdout.splitlines()] == ["lost", "->", "->"]


@pytest.mark.parametrize(
    ("polled", "told"), [([POLLED], "Lately only the gateway itself has asked"), ([], "Nothing of that went")]
)
def test_a_quiet_line_says_so(
    monkeypatch: pytest.MonkeyPatch, polled: list[dict[str, Any]], told: str
) -> None:
    answers: list[tuple[int, object]] = [(200, {"entries": []}), (200, {"entries": polled})]
    gateway = FakeGateway({"/lines/arm/trace": answers})
    said = gateway.run(monkeypatch, "trace", "arm", "--last", "4")
    assert [request.query["polls"] for request in gateway.asked] == ["false", "true"]
    assert said.exit_code == 0
    assert said.stdout == ""
    assert told in said.stderr


def test_a_line_that_is_not_there_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    said = always({"detail": "There is no line leg.", "moved": "no"}, 404).run(monkeypatch, "trace", "leg")
    assert said.exit_code == 2
    assert "There is no line leg." in said.stderr


def test_after_a_break_the_trace_goes_on_where_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    connections: list[str | BaseException] = [
        f": the trace from now on\n\nevent: trace\ndata: {json.dumps(SENT)}\n\nid: 7\n\n",
        http.AnswerLost("gone"),
        'event: gap\ndata: {"missed":12}\n\nid: 20\n\n'
        f"event: trace\ndata: {json.dumps(HEARD)}\n\nid: 21\n\n",
        KeyboardInterrupt(),
    ]
    resumed: list[str | None] = []

    @contextmanager
    def stream(_method: str, _url: str, *, headers: dict[str, str], **_: object) -> Iterator[httpx.Response]:
        resumed.append(headers.get("Last-Event-ID"))
        now = connections.pop(0)
        if not isinstance(now, str):
            raise now
        yield httpx.Response(200, text=now)

    monkeypatch.setattr(http, "stream", stream)
    monkeypatch.setattr(watch, "TRY_AGAIN_S", 0.0)
    said = FakeGateway().run(monkeypatch, "trace", "arm", "--follow", "--json")
    assert said.exit_code == 0, said.output
    assert list(map(json.loads, said.stdout.splitlines())) == [SENT, HEARD]
    assert resumed == [None, "7", "7", "21"]
    assert "12 records were forgotten" in said.stderr
