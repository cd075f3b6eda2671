"""Sessions and the security log from the command line."""

import json

import pytest

from app import exits
from tests.app.fake_gateway import Answer, FakeGateway

ANN = {
    "id": "s-1",
    "name": "ann",
    "role": "admin",
    "address": "10.0.0.9",
    "began_at": "2026-11-24T08:00:00Z",
    "used_at": "2026-11-24T08:05:00Z",
}
BOB = {**ANN, "id": "s-2", "name": "bob", "role": "viewer", "address": None}
MADE = {
    "number": 2,
    "time": "2026-11-24T08:01:00Z",
    "type": "key.made",
    "caller": "ann",
    "address": "10.0.0.9",
    "target": "mes",
    "count": 1,
    "data": {"role": "operator", "scope": None},
}
REFUSED = {
    "number": 3,
    "time": "2026-11-24T08:02:00Z",
    "type": "sign_in.refused",
    "caller": None,
    "address": None,
    "target": "/sign-in",
    "count": 17,
    "data": {"why": "The key is not good."},
}


def gateway(**answers: object) -> FakeGateway:
    told: dict[str, list[Answer]] = {f"/{name}": [(200, answer)] for name, answer in answers.items()}
    return FakeGateway(told)


@pytest.mark.parametrize("words", [("sessions",), ("sessions", "list")])
def test_who_has_signed_in_is_a_table_whose_names_come_first(
    monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    said = gateway(**{"access/sessions": {"sessions": [ANN, BOB]}}).run(monkeypatch, *words)
    assert [line.split() for line in said.stdout.splitlines()] == [
        ["NAME", "ROLE", "ADDRESS", "BEGAN", "USED", "ID"],
        ["ann", "admin", "10.0.0.9", ANN["began_at"], ANN["used_at"], "s-1"],
        ["bob", "viewer", "-", ANN["began_at"], ANN["used_at"], "s-2"],
    ]


def test_a_session_is_ended_by_its_id(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = gateway(**{"access/sessions/s-2": BOB})
    said = asked.run(monkeypatch, "sessions", "end", "s-2")
    assert (said.exit_code, said.stdout) == (0, "The session of bob from an unknown address is ended.\n")
    assert (asked.asked[-1].method, asked.asked[-1].path) == ("DELETE", "/access/sessions/s-2")


def test_all_sessions_of_a_key_are_ended_by_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = gateway(**{"access/sessions": {"sessions": [ANN, ANN]}})
    said = asked.run(monkeypatch, "sessions", "end", "--key", "ann")
    assert (said.exit_code, len(said.stdout.splitlines())) == (0, 2)
    assert asked.asked[-1].method == "DELETE"
    none = gateway(**{"access/sessions": {"sessions": []}}).run(monkeypatch, "sessions", "end", "--key", "x")
    assert none.exit_code == exits.REFUSED
    assert "x has no session; none was ended." in none.stderr


@pytest.mark.parametrize("words", [(), ("s-1", "--key", "ann")])
def test_either_one_session_or_a_key_is_named(
    monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    assert gateway().run(monkeypatch, "sessions", "end", *words).exit_code == exits.USAGE


def test_the_security_log_is_read_with_the_newest_entry_last(monkeypatch: pytest.MonkeyPatch) -> None:
    log = gateway(security={"entries": [REFUSED, MADE], "cursor": None})
    lines = log.run(monkeypatch, "security", "--limit", "2").stdout.splitlines()
    assert [line.split()[:5] for line in lines[1:]] == [
        [MADE["time"], "key.made", "ann", "10.0.0.9", "mes"],
        [REFUSED["time"], "sign_in.refused", "-", "-", "/sign-in"],
    ]
    assert lines[1].endswith("role=operator")
    assert lines[2].endswith("17 times, why=The key is not good.")
    as_json = gateway(security={"entries": [MADE], "cursor": None}).run(monkeypatch, "security", "--json")
    assert json.loads(as_json.stdout)["entries"] == [MADE]
