"""`commission`: a line is tried at its port, reported, and its file changed where people ask for it."""

import json
import subprocess
import sys
from contextlib import AbstractContextManager
from pathlib import Path
from signal import SIGKILL
from typing import Any

import httpx
import pytest
from typer.testing import CliRunner, Result

from app.cli import app
from app.commands import commission
from commissioning.debts import debts_file
from gateway.config import load
from protocols.rorze.link import Request, RequestReader
from protocols.rorze.row import LINK_MASTER
from simulator.rorze.line import Rc400Line, build_line
from simulator.rorze.quirks import QUIRKS
from tests.app.fake_gateway import FakeGateway
from tests.commissioning.served_simulator import behind_a_terminal
from transports.trace import unescape

BODY = """
[[lines]]
id = "robot"
address = "serial://{port}?baud=115200"
# as the maker says
late_reply_s = 0.1   # short
reply_timeout_s = 0.2
[[lines.bodies]]
id = "00"
"""


def run(*words: str | Path, answer: str = "") -> Result:
    return CliRunner().invoke(app, [str(word) for word in words], input=answer)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A configuration with one line."""
    file = tmp_path / "gateway.toml"
    file.write_text(BODY.format(port=tmp_path / "port"), "utf-8")
    return file


def serving(file: Path, *quirks: str) -> AbstractContextManager[None]:
    """A simulated line at the port of the file."""

    def make(now: float) -> Rc400Line:
        line = build_line((0x00,), now)
        for name in quirks:
            QUIRKS[name](line)
        return line

    return behind_a_terminal(make, file.parent / "port")


def test_a_line_that_is_as_assumed_agrees(file: Path, tmp_path: Path) -> None:
    report = tmp_path / "F.json"
    with serving(file):
        said = run("commission", "robot", "--config", file, "--report", report)
    assert said.exit_code == 0, said.output
    told = json.loads(report.read_text("utf-8"))
    assert told["line"] == "robot"
    assert {result["result"] for result in told["results"]} == {"agrees", "cannot_tell"}
    assert all(result["needed"] for result in told["results"] if result["result"] == "cannot_tell")
    assert {"at", "dir", "data"} == set(told["frames"][0])
    sent = b"".join(unescape(frame["data"]) for frame in told["frames"] if frame["dir"] == "tx")
    to_master = [
        request.text
        for request in RequestReader().feed(sent)
        if isinstance(request, Request) and request.body == LINK_MASTER
    ]
    assert to_master == ["XID"]
    assert "silent-xid" in report.with_suffix(".md").read_text("utf-8")


def test_what_differs_is_proposed_as_a_change_of_the_file(file: Path) -> None:
    before = file.read_text("utf-8")
    with serving(file, "interjection"):
        said = run("commission", "robot", "--config", file)
        assert said.exit_code == 1
        assert '+stop_mode = "after_reply"' in said.stdout
        assert file.read_text("utf-8") == before
        assert "never tried" in run("check", file).stdout
        report = file.parent / "F.json"
        assert run("commission", "robot", "--config", file, "--apply", "--report", report).exit_code == 1
        assert "line robot: Some assumptions do not hold: the report says what" in run("check", file).stdout
        assert load(file).lines[0].model_dump()["stop_mode"] == "after_reply"
        assert "late_reply_s = 0.1   # short" in file.read_text("utf-8")
        assert run("commission", "robot", "--config", file).exit_code == 0


def test_a_contradiction_says_that_nothing_is_to_be_moved(file: Path) -> None:
    with serving(file, "wrong-mode"):
        said = run("commission", "robot", "--config", file)
    assert said.exit_code == 1
    assert "Do not run motion" in said.stderr


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["lift"], "has no line lift"),
        (["robot", "--allow", "flash"], "--allow takes settings or motion"),
        (["robot", "--report", "F.txt"], "it ends with .json"),
    ],
)
def test_what_is_not_understood_sends_nothing(file: Path, words: list[str], sentence: str) -> None:
    said = run("commission", *words, "--config", file)
    assert said.exit_code == 2
    assert sentence in said.stderr
    assert said.stderr.endswith("Nothing was sent.\n")


def test_a_port_that_is_not_there_is_told(file: Path) -> None:
    said = run("commission", "robot", "--config", file)
    assert said.exit_code == 3
    assert "was not commissioned" in said.stderr


def test_at_a_terminal_people_are_asked(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    async def confirm(what: str) -> bool:
        asked.append(what)
        return False

    monkeypatch.setattr(commission, "_confirm", confirm)
    with serving(file):
        assert run("commission", "robot", "--config", file, "--allow", "settings").exit_code == 0
    assert [question for question in asked if question.startswith("Body 00:") and "9VS" in question]
    asked.clear()
    with serving(file):
        agreed = run("commission", "robot", "--config", file, "--allow", "settings", "--yes", "00")
    assert agreed.exit_code == 0
    assert [question for question in asked if question.startswith("Body 00:")] == []


RECORD = {"id": "c", "line_id": "robot", "status": "running", "done": 3, "of": 16, "doing": "echo"}
REPORT = {
    "version": "1",
    "line": "robot",
    "protocol": "rorze",
    "address": "serial:///dev/ttyUSB0",
    "started_at": "2026-11-28T02:00:00.000Z",
    "ended_at": "2026-11-28T02:01:00.000Z",
    "results": [
        {
            "assumption": "interjection",
            "result": "differs",
            "setting": {"key": "stop_mode", "now": "interject", "proposed": "after_reply"},
            "seen": "1 of 3 questions in one go were answered.",
        }
    ],
    "frames": [],
}


def test_a_running_gateway_is_asked_to_commission(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    over = RECORD | {"status": "finished", "report": REPORT, "error": None}
    gateway = FakeGateway(
        {
            "/commissionings": [(202, RECORD | {"report": None})],
            "/commissionings/c": [(200, over)],
        }
    )
    said = gateway.run(monkeypatch, "commission", "robot", "--report", str(tmp_path / "F.json"))
    assert said.exit_code == 1
    assert "Set stop_mode of line robot to 'after_reply'" in said.stdout
    assert json.loads((tmp_path / "F.json").read_text("utf-8"))["line"] == "robot"


def test_a_running_gateway_writes_what_is_proposed(monkeypatch: pytest.MonkeyPatch) -> None:
    over = RECORD | {"status": "finished", "report": REPORT, "error": None}
    gateway = FakeGateway({"/commissionings": [(200, over)], "/commissionings/c/settings": [(200, {})]})
    said = gateway.run(monkeypatch, "commission", "robot", "--apply")
    assert said.exit_code == 1
    assert gateway.paths == ["/commissionings", "/commissionings/c/settings"]
    assert "serves robot so" in said.stderr


def test_an_interruption_cancels_it(monkeypatch: pytest.MonkeyPatch) -> None:
    class Interrupted(FakeGateway):
        def request(self, method: str, url: str, **options: Any) -> httpx.Response:
            if method == "DELETE":
                self.answers["/commissionings/c"] = [(200, cancelled)]
            return super().request(method, url, **options)

    cancelled = RECORD | {"status": "cancelled", "report": None, "error": "It was cancelled."}
    gateway = Interrupted(
        {
            "/commissionings": [(202, RECORD | {"report": None})],
            "/commissionings/c": [(200, KeyboardInterrupt())],
        }
    )
    said = gateway.run(monkeypatch, "commission", "robot")
    assert said.exit_code == 1
    assert "It was cancelled." in said.stderr
    assert [request.method for request in gateway.asked] == ["POST", "GET", "DELETE"]


@pytest.mark.parametrize("words", [["--allow", "settings"], ["--allow", "motion"]])
def test_beside_a_gateway_only_questions_are_sent(monkeypatch: pytest.MonkeyPatch, words: list[str]) -> None:
    gateway = FakeGateway()
    said = gateway.run(monkeypatch, "commission", "robot", *words)
    assert said.exit_code == 2
    assert "needs --config FILE" in said.stderr
    assert gateway.asked == []


def test_ctrl_c_says_what_was_done_to_the_motor(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("commissioning.run.commission", interrupted)
    said = run("commission", "robot", "--config", file)
    assert said.exit_code == 1
    assert "What was set was set back" in said.stderr
    owed = debts_file(file, "robot")
    owed.write_text("[]", "utf-8")
    assert f"Not all that was set is set back ({owed})" in run("commission", "robot", "--config", file).stderr


KILLED = """
import os, signal, sys
from app.cli import app
from commissioning.debts import Debts
Debts.cross_out = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
app(sys.argv[1:])
"""
"""The program, killed before it notes that a setting was set back."""


def test_a_killed_commissioning_is_told_of_and_set_back_by_the_next(file: Path) -> None:
    """Killed outright, after it has set a comment: the file of what it owes stands, and `check` says so."""
    owed = debts_file(file, "robot")
    with serving(file):
        words = ["commission", "robot", "--config", str(file), "--allow", "settings", "--yes", "00"]
        killed = subprocess.run([sys.executable, "-c", KILLED, *words], check=False)  # noqa: S603  # our own
        assert killed.returncode == -SIGKILL
        assert "left something set" in run("check", file).stderr
        asked = run("commission", "robot", "--config", file)
        assert asked.exit_code == 1
        assert "00: &009VS1," in asked.stderr
        assert "&009VS1," not in run(*words).stderr
    assert not owed.exists()
    assert "left something set" not in run("check", file).stderr


def test_what_is_owed_has_to_be_readable(file: Path) -> None:
    debts_file(file, "robot").write_text("nonsense", "utf-8")
    said = run("commission", "robot", "--config", file)
    assert said.exit_code == 3
    assert "Nothing was sent" in said.stderr
