"""The command `stop`: the requests it sends, without waiting for anything that a stop can do without."""

from typing import Any

import pytest

from tests.app.fake_gateway import Answer, FakeGateway, always, plant, stopped

OVER: list[Answer] = [(200, stopped("confirmed"))]


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        (stopped("confirmed"), 0),
        (stopped("sent"), 4),
        (stopped("acknowledged"), 4),
        (stopped("confirmed", "acknowledged"), 4),
        (stopped("not_sent"), 3),
        (stopped("not_sent", "sent"), 4),
        ({"confirmed": False, "bodies": [], "robots": [{"robot_id": "r1", "state": "not_sent"}]}, 3),
        ({"confirmed": False, "bodies": [], "robots": [{"robot_id": "r1", "state": "sent"}]}, 4),
    ],
)
def test_a_stop_is_done_when_standstill_is_confirmed(
    answer: dict[str, Any], code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    gateway = always(answer)
    assert gateway.run(monkeypatch, "stop").exit_code == code
    assert gateway.posted == [("/stop", {"mode": "decelerate"})]


@pytest.mark.parametrize(
    ("word", "path"),
    [
        ("3f", "/bodies/3F/stop"),
        ("A.80", "/groups/a.80/stop"),
        ("r1", "/robots/r1/stop"),
        ("r1/units/2", "/robots/r1/units/2/stop"),
    ],
)
def test_what_has_an_address_is_stopped_by_one_request(
    word: str, path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    gateway = FakeGateway({path: OVER})
    said = gateway.run(monkeypatch, "stop", word, "--mode", "immediate")
    assert (said.exit_code, said.stdout) == (0, "a.3F  confirmed\n")
    assert gateway.posted == [(path, {"mode": "immediate"})]
    assert len(gateway.asked) == 1


def test_a_stop_whose_wait_is_broken_off_is_not_called_confirmed(monkeypatch: pytest.MonkeyPatch) -> None:
    said = FakeGateway({"/stop": [(200, KeyboardInterrupt())]}).run(monkeypatch, "stop")
    assert (said.exit_code, said.stdout) == (4, "")
    assert said.stderr.startswith("Interrupted before standstill was confirmed.")


@pytest.mark.parametrize(("name", "path"), [("lift", "/bodies/a.02/stop"), ("the arm", "/bodies/a.3F/stop")])
def test_a_name_is_looked_up(name: str, path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    gateway = FakeGateway({**plant(b02="lift", b3F="the arm"), path: OVER})
    assert gateway.run(monkeypatch, "stop", name).exit_code == 0
    assert gateway.paths[-1] == path


def test_one_that_cannot_be_stopped_does_not_keep_the_others_from_it(monkeypatch: pytest.MonkeyPatch) -> None:
    gateway = FakeGateway({**plant(), "/bodies/3F/stop": OVER, "/bodies/02/stop": [(200, stopped("sent"))]})
    said = gateway.run(monkeypatch, "stop", "nobody", "3F", "02")
    assert said.exit_code == 4
    assert said.stdout.splitlines() == ["a.3F  confirmed", "a.3F  sent"]
    assert "nothing called 'nobody'" in said.stderr
    assert "`motion-gateway stop` without a name stops everything" in said.stderr


def test_a_crowded_gateway_still_stops_what_has_an_address(monkeypatch: pytest.MonkeyPatch) -> None:
    gateway = FakeGateway({"/bodies/3F/stop": OVER}, (503, {"detail": "Too many connections."}))
    said = gateway.run(monkeypatch, "stop", "3F", "lift")
    assert said.exit_code == 3
    assert said.stdout == "a.3F  confirmed\n"


def test_reports_as_json(monkeypatch: pytest.MonkeyPatch) -> None:
    said = always(stopped("sent")).run(monkeypatch, "stop", "--json")
    assert '"confirmed": false' in said.stdout
