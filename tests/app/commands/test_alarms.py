"""The command `alarms`: the alarms it shows, and those it resets."""

import json

import pytest

from tests.app.fake_gateway import Answer, FakeGateway, always

ALARM = {
    "id": "al1",
    "cause": "body.offline",
    "subject": "/bodies/a.3F",
    "raised_at": "2026-01-01T00:00:00Z",
    "ended_at": None,
    "reset_at": None,
    "en": {"happened": "It is gone.", "motor": "It stands.", "remedy": "Look."},
    "next": [{"method": "POST", "path": "/bodies/a.3F/stop", "right": "stop", "en": "Stop it."}],
}
OVER = {**ALARM, "id": "al2", "ended_at": "2026-01-01T00:00:01Z"}
RESET = {**OVER, "id": "al3", "reset_at": "2026-01-01T00:00:02Z"}


def test_alarms_say_what_happened_and_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    said = always({"alarms": [ALARM, OVER, RESET]}).run(monkeypatch, "alarms", "--all")
    assert said.exit_code == 0, said.output
    first, second, third = said.stdout.split("\n\n")
    assert first.splitlines() == [
        "a.3F  body.offline  since 2026-01-01T00:00:00Z  stands now  (al1)",
        "    It is gone.",
        "    It stands.",
        "    Look.",
        "    POST /bodies/a.3F/stop (stop): Stop it.",
    ]
    states = [text.splitlines()[0].split()[-3:-1] for text in (second, third)]
    assert states == [["over", "2026-01-01T00:00:01Z"], ["reset", "2026-01-01T00:00:02Z"]]


def test_no_alarm_is_said_too(monkeypatch: pytest.MonkeyPatch) -> None:
    assert always({"alarms": []}).run(monkeypatch, "alarms").stdout == "No alarm stands.\n"


def test_scripts_take_json(monkeypatch: pytest.MonkeyPatch) -> None:
    said = always({"alarms": [ALARM]}).run(monkeypatch, "alarms", "--json")
    assert json.loads(said.stdout) == {"alarms": [ALARM]}


def test_each_alarm_is_reset_though_another_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    lasts = {"detail": "Its cause lasts.", "moved": "no"}
    gateway = FakeGateway({"/alarms/al1/reset": [(409, lasts)], "/alarms/al2/reset": [(200, RESET)]})
    said = gateway.run(monkeypatch, "alarms", "reset", "al1", "al2")
    assert said.exit_code == 1
    assert "Its cause lasts." in said.stderr
    assert said.stdout == "a.3F  body.offline is reset (al3).\n"
    assert gateway.paths == ["/alarms/al1/reset", "/alarms/al2/reset"]


def test_an_id_is_no_path(monkeypatch: pytest.MonkeyPatch) -> None:
    gateway = FakeGateway()
    assert gateway.run(monkeypatch, "alarms", "reset", "../stop?x").exit_code == 2
    assert gateway.asked[0].path == "/alarms/../stop?x/reset"


def test_all_that_are_over_are_reset_oldest_first_and_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    newer = {**OVER, "id": "al9"}
    answers: dict[str, list[Answer]] = {
        "/alarms": [(200, {"alarms": [newer, ALARM, OVER]})],
        f"/alarms/{OVER['id']}/reset": [(200, RESET)],
        "/alarms/al9/reset": [(200, RESET)],
    }
    gateway = FakeGateway(answers)
    assert gateway.run(monkeypatch, "alarms", "reset", "--over").exit_code == 0
    assert [request.path for request in gateway.asked][1:] == [
        f"/alarms/{OVER['id']}/reset",
        "/alarms/al9/reset",
    ]


@pytest.mark.parametrize("words", [(), ("al1", "--over")])
def test_either_ids_or_all_that_are_over(monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]) -> None:
    gateway = FakeGateway({})
    assert gateway.run(monkeypatch, "alarms", "reset", *words).exit_code == 2
    assert not gateway.asked


def test_what_tells_the_same_event_stands_behind_it(monkeypatch: pytest.MonkeyPatch) -> None:
    move = {**ALARM, "id": "al7", "cause": "body.move.failed", "part_of": ALARM["id"]}
    said = always({"alarms": [move, OVER, ALARM]}).run(monkeypatch, "alarms").stdout
    ids = [block.splitlines()[0].split()[-1] for block in said.split("\n\n")]
    assert ids == ["(al2)", "(al1)", "(al7)"]
    assert f"(part of {ALARM['id']})" in said
