"""`motion-gateway trace`: what was said on a line, and what is."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import httpx
import pytest

from app import http
from app.commands import watch
from app.commands.trace import folded, meaning
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


def record(kind: str, data: str, caller: str | None = None) -> dict[str, Any]:
    return {"at": "t", "kind": kind, "data": data + "\\r", "caller": caller}


@pytest.mark.parametrize(
    ("asked", "answered", "said"),
    [
        ("&3F9CD", ">&3F9CDH08", "get the controller status: command error"),
        ("&3F9CD", ">&3F9CDH00", "get the controller status: none"),
        ("&3F9MD", ">&3F9MDH0A", "get the cause of the end of the last move: cw limit, ems"),
        ("&3F6PD", ">&3F6PD+000012345", "get the present position: 12345"),
        ("&3F1+M500", ">&3F1+M", "relative move clockwise at high speed: accepted"),
        ("&3F5IS", None, "software stop, at once"),
        ("ACD", "ACD 2700", "get the status of the unit's motor axes; clears no error: 2700"),
        ("&3FQQQ", ">&3FQQQ7", "7"),
        ("???", None, ""),
        ("hello", "&&&", ""),
    ],
)
def test_a_frame_and_its_answer_have_a_meaning(asked: str, answered: str | None, said: str) -> None:
    told = meaning(record("tx", asked), None if answered is None else record("rx", answered))
    assert told == said


def test_a_refusal_is_told_with_its_reason() -> None:
    told = meaning(record("tx", "&3F9CD9"), record("rx", ">&3F@49"))
    assert told.startswith("get the controller status: refused: ")


def test_an_answer_that_comes_between_others_stands_alone() -> None:
    stop, poll, late, reply = (
        record("tx", "&3F5IS", "pat"),
        record("tx", "&009CD", "gateway: poll"),
        record("rx", ">&3F5IS"),
        record("rx", ">&009CDH00"),
    )
    assert list(folded([stop, poll, late, reply])) == [
        (stop, None),
        (poll, None),
        (late, None),
        (reply, None),
    ]
    assert list(folded([poll, reply, stop, late])) == [(poll, reply), (stop, late)]
