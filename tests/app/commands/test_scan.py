"""`scan`: who answers on a line or at a port, and is served from then on."""

from typing import Any

import pytest

from tests.app.fake_gateway import FakeGateway, always

CELL = {
    "id": "cell1",
    "address": "tcp://cell:1",
    "protocol": "fics",
    "robot": {"id": "r1", "units": [{"number": 1, "axes": ["X", "Y"]}]},
}
FOUND = {
    "id": "s",
    "status": "finished",
    "doing": [],
    "notes": [],
    "error": None,
    "found": [{"address": "tcp://cell:1", "told": "a Fics.", "line": CELL, "comment": "Compare its axes."}],
}


@pytest.mark.parametrize(
    ("answer", "code", "sentence"),
    [
        ({"status": "finished", "found": [{"body_id": "a.00", "configured": True}]}, 0, ""),
        ({"status": "running", "asked": 1, "id": "s", "found": []}, 5, "The scan s is still running"),
        ({"status": "failed", "found": [], "error": "Line a is down."}, 1, "Line a is down."),
    ],
)
def test_a_scan_is_done_when_everybody_was_asked(
    answer: dict[str, Any], code: int, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = always(answer).run(monkeypatch, "scan", "a")
    assert said.exit_code == code
    assert sentence in said.stderr
    assert said.stdout == ("a.00\n" if code == 0 else "")


def test_bodies_that_are_new_are_added_when_that_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    found = [{"body_id": "a.00", "configured": True}, {"body_id": "a.3F", "configured": False}]
    gateway = always({"status": "finished", "found": found})
    said = gateway.run(monkeypatch, "scan", "a", "--add")
    assert said.exit_code == 0
    assert gateway.posted[1:] == [
        ("/lines/a/bodies", {"bodies": [{"id": "3F"}], "comment": "Found by a scan."})
    ]
    assert "Served now, and written into the configuration: a.3F." in said.stderr


def test_who_is_at_a_port_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    gateway = FakeGateway({"/system/scans": [(200, FOUND)]})
    said = gateway.run(monkeypatch, "scan", "tcp://cell:1")
    assert (said.exit_code, said.stdout) == (0, "a Fics.\n")
    assert gateway.posted == [("/system/scans", {"ports": ["tcp://cell:1"]})]


def test_a_robot_at_a_port_is_added_with_what_to_compare(monkeypatch: pytest.MonkeyPatch) -> None:
    gateway = FakeGateway({"/system/scans": [(200, FOUND)], "/lines": [(200, {"lines": []})]})
    said = gateway.run(monkeypatch, "scan", "tcp://cell:1", "--add")
    assert said.exit_code == 0
    assert gateway.posted[1:] == [("/lines", {"line": CELL, "comment": "Compare its axes."})]
    assert "Served now, and written into the configuration: cell1." in said.stderr
    assert "Compare its axes." in said.stderr


def test_a_port_at_which_nobody_answers_ends_with_1(monkeypatch: pytest.MonkeyPatch) -> None:
    nobody = FOUND | {"found": [], "notes": ["tcp://cell:1 was not opened: refused."]}
    said = FakeGateway({"/system/scans": [(200, nobody)]}).run(monkeypatch, "scan", "tcp://cell:1", "--add")
    assert said.exit_code == 1
    assert "was not opened" in said.stderr
    assert "Nobody was found" in said.stderr


def test_an_interruption_breaks_the_scan_of_a_port_off(monkeypatch: pytest.MonkeyPatch) -> None:
    broken_off = FOUND | {"status": "failed", "error": "It was broken off."}
    gateway = FakeGateway(
        {
            "/system/scans": [(202, FOUND | {"status": "running", "found": [], "doing": ["asking"]})],
            "/system/scans/s": [(200, KeyboardInterrupt())],
            "/system/scans/current": [(200, broken_off)],
        }
    )
    said = gateway.run(monkeypatch, "scan", "tcp://cell:1", "--add")
    assert said.exit_code == 1
    assert said.stdout == "a Fics.\n"
    assert [request.method for request in gateway.asked] == ["POST", "GET", "DELETE"], "nothing was added"
