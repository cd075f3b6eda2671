"""What `send` and `scan` make of the gateway's answers: what is sent, and the exit code a script gets."""

from typing import Any

import httpx
import pytest
from typer.testing import CliRunner, Result

from app import cli


class FakeGateway:
    """Answers every request alike, and keeps what was asked."""

    def __init__(self, status: int, answer: object) -> None:
        self._status, self._answer = status, answer
        self.paths: list[str] = []
        self.sent: list[object] = []
        self.ids: list[str] = []

    def request(
        self, _method: str, url: str, *, json: object, headers: dict[str, str], **_: object
    ) -> httpx.Response:
        self.ids.append(headers["X-Request-Id"])
        self.paths.append(httpx.URL(url).path)
        self.sent.append(json)
        return httpx.Response(self._status, json=self._answer)


def run(monkeypatch: pytest.MonkeyPatch, answer: object, *words: str, status: int = 200) -> Result:
    monkeypatch.setattr(httpx, "request", FakeGateway(status, answer).request)
    return CliRunner().invoke(cli.app, words)


def move(status: str, moved: str | None = None) -> dict[str, Any]:
    return {"status": status, "error": moved and {"moved": moved}}


def stop(*states: str) -> dict[str, Any]:
    confirmed = all(state == "confirmed" for state in states)
    return {"confirmed": confirmed, "bodies": [{"state": state} for state in states], "robots": []}


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        (move("succeeded"), 0),
        (move("stopped", "yes"), 1),
        (move("failed", "yes"), 1),
        (move("failed", "no"), 1),
        (move("failed", "unknown"), 4),
        (move("rejected", "no"), 1),
        (move("cancelled", "no"), 1),
        (move("lost", "yes"), 1),
        (move("lost", "unknown"), 4),
        (move("unknown", "unknown"), 4),
        (move("unknown", "yes"), 4),
        (move("moving"), 5),
        (move("sent"), 5),
    ],
)
def test_the_end_of_a_move_that_was_waited_for(
    answer: dict[str, Any], code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run(monkeypatch, answer, "send", "3F", "1+M500", "--wait", "10").exit_code == code


def test_a_move_that_nobody_waits_for_is_done_when_it_is_under_way(monkeypatch: pytest.MonkeyPatch) -> None:
    said = run(monkeypatch, move("moving"), "send", "3F", "1+M500", status=202)
    assert (said.exit_code, '"status": "moving"' in said.stdout) == (0, True)


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        (stop("confirmed"), 0),
        (stop("sent"), 4),
        (stop("acknowledged"), 4),
        (stop("confirmed", "acknowledged"), 4),
        (stop("not_sent"), 3),
        (stop("not_sent", "sent"), 4),
    ],
)
def test_a_stop_is_done_when_standstill_is_confirmed(
    answer: dict[str, Any], code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run(monkeypatch, answer, "send", "3F", "5IS").exit_code == code


def test_a_reply_may_have_a_status_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    assert run(monkeypatch, {"status": 1}, "send", "3F", "URD", "--wait", "10").exit_code == 0


@pytest.mark.parametrize(
    ("status", "problem", "code"),
    [
        (409, {"moved": "unknown", "detail": "No reply."}, 4),
        (409, {"moved": "no", "detail": "The body is busy."}, 1),
        (409, {"moved": "no", "type": "urn:motion-gateway:problem:no-reply", "detail": "No reply."}, 4),
        (409, {"moved": "no", "type": "urn:motion-gateway:problem:ambiguous-address", "detail": "Two."}, 2),
        (422, {"moved": "no", "detail": "Refused.", "code": "0x4A"}, 1),
        (422, {"moved": "no", "detail": "distance: too long."}, 2),
        (404, {"moved": "no", "detail": "There is no body 3F."}, 2),
        (503, {"moved": "no", "detail": "The line is down."}, 3),
        (502, ["a proxy"], 4),
    ],
)
def test_a_problem_is_told_in_its_sentence(
    status: int, problem: object, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = run(monkeypatch, problem, "send", "3F", "6PD", status=status)
    assert (said.exit_code, said.stdout) == (code, "")
    assert (problem["detail"] if isinstance(problem, dict) else "answer was lost") in said.stderr


def test_each_call_has_an_id_of_its_own_and_an_error_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for status, answer in ((404, {"moved": "no", "detail": "There is no body 3F."}), (502, ["a proxy"])):
        gateway = FakeGateway(status, answer)
        monkeypatch.setattr(httpx, "request", gateway.request)
        errors = [CliRunner().invoke(cli.app, ["send", "3F", "6PD"]).stderr for _ in range(2)]
        assert len(set(gateway.ids)) == 2
        assert all(f"request {name}" in error for name, error in zip(gateway.ids, errors, strict=True))


@pytest.mark.parametrize(
    ("written", "path", "parameters"),
    [
        ("6pd", "get-position", {}),
        ("1+ma[12],500", "move-clockwise", {"distance": 500, "pattern": 12}),
        (" 1+M A[12], 500 ", "move-clockwise", {"distance": 500, "pattern": 12}),
        ("9vs7,Left arm", "set-user-comment", {"comment_number": 7, "text": "Left arm"}),
    ],
)
def test_case_and_blanks_matter_only_in_texts(
    written: str, path: str, parameters: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    gateway = FakeGateway(200, move("succeeded"))
    monkeypatch.setattr(httpx, "request", gateway.request)
    said = CliRunner().invoke(cli.app, ["send", "3F", written])
    assert said.exit_code == 0, said.stderr
    assert (gateway.paths, gateway.sent) == ([f"/bodies/3F/commands/{path}"], [parameters])


def test_a_command_of_robots_is_not_said_to_be_none(monkeypatch: pytest.MonkeyPatch) -> None:
    said = run(monkeypatch, {}, "send", "r1", "ORG")
    assert said.exit_code == 2
    assert "no command 'ORG' of RC-420 bodies" in said.stderr
    assert "Robots have routes of their own" in said.stderr


@pytest.mark.parametrize("written", ["", "6P", "zzz", "1+Mfast", "1+M0", "6PD1"])
def test_what_is_no_command_is_not_sent(written: str, monkeypatch: pytest.MonkeyPatch) -> None:
    gateway = FakeGateway(200, {})
    monkeypatch.setattr(httpx, "request", gateway.request)
    said = CliRunner().invoke(cli.app, ["send", "3F", written])
    assert (said.exit_code, said.stdout, gateway.paths) == (2, "", [])


@pytest.mark.parametrize(
    ("answer", "code", "sentence"),
    [
        ({"status": "finished", "found": [{"body_id": "a.00", "configured": True}]}, 0, ""),
        ({"status": "running", "found": []}, 5, "The scan of a is still running"),
        ({"status": "failed", "found": [], "error": "Line a is down."}, 1, "Line a is down."),
    ],
)
def test_a_scan_is_done_when_everybody_was_asked(
    answer: dict[str, Any], code: int, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = run(monkeypatch, answer, "scan", "a")
    assert said.exit_code == code
    assert sentence in said.stderr
    assert said.stdout == ("a.00\n" if code == 0 else "")
