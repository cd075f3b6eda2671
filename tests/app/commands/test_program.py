"""User programs on the command line: faults as compilers tell them, and exit codes that scripts can use."""

from pathlib import Path
from typing import Any

import httpx
import pytest
from typer.testing import CliRunner, Result

from app import cli, http
from tests.app.fake_gateway import FakeGateway, plant

BLINK = "*BLINK ; a label\n SET OD0\n END\n"
DONE = {"status": "succeeded", "error": None, "stored": "RAM holds the program.", "phase": "done"}
RUNNING = {"id": "7", "status": "running", "phase": "writing", "written": 1, "instructions": 3}
DIFFERS = {
    "status": "failed",
    "stored": "RAM holds something else.",
    "error": {"detail": "Line 2: it holds END.", "remedy": "Upload it again."},
}
PLACE = "/bodies/3F/program/uploads/7"


def invoke(*words: str) -> Result:
    return CliRunner().invoke(cli.app, ["program", *words])


@pytest.fixture
def source(tmp_path: Path) -> Path:
    file = tmp_path / "blink.txt"
    file.write_text(BLINK)
    return file


def answering(monkeypatch: pytest.MonkeyPatch, *answers: httpx.Response) -> list[tuple[str, str, Any]]:
    """Let a gateway give these answers in turn; what it is asked is kept."""
    asked: list[tuple[str, str, Any]] = []

    def request(method: str, url: str, **options: Any) -> httpx.Response:
        asked.append((method, url, options))
        return answers[len(asked) - 1]

    monkeypatch.setattr(http, "request", request)
    return asked


def test_a_program_is_checked_without_a_gateway(source: Path) -> None:
    said = invoke("check", str(source))
    assert (said.exit_code, said.stdout) == (0, "3 instructions, 6 of 6039 steps.\nLabels: BLINK.\n")


def test_a_program_that_goes_on_behind_its_end_does_not_pass(
    source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source.write_text("*BLINK\n SET OD0\n")
    told = f"{source}:2:1: The program goes on behind its last instruction: it needs END there"
    said = invoke("check", str(source))
    assert (said.exit_code, said.stdout) == (1, "")
    assert said.stderr.startswith(told)
    answering(monkeypatch, httpx.Response(200, json={"bodies": []}), httpx.Response(200, json=DONE))
    assert told in invoke("upload", "3F", str(source)).stderr, "a controller takes it"


def test_faults_are_told_as_compilers_tell_them(source: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = answering(monkeypatch)
    source.write_text("END\n JMP *NO\n FUS\n")
    for words in (("check", str(source)), ("upload", "3F", str(source))):
        said = invoke(*words)
        assert said.exit_code == 1
        assert (
            said.stderr
            == f"{source}:2:6: There is no label *NO.\n{source}:3:2: FUS cannot stand in a program.\n"
        )
    assert not asked


def test_what_cannot_be_read_is_no_program(tmp_path: Path) -> None:
    garbled = tmp_path / "garbled"
    garbled.write_bytes(b"\xff")
    assert [invoke("check", str(file)).exit_code for file in (tmp_path / "no", tmp_path, garbled)] == [
        2,
        2,
        2,
    ]


def test_an_upload_is_followed_to_its_end(source: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begun = httpx.Response(202, json=RUNNING)
    asked = answering(monkeypatch, begun, httpx.Response(200, json=DONE))
    said = invoke("upload", "3F", str(source), "--flash", "--url", "http://gate")
    assert (said.exit_code, said.stdout) == (0, "RAM holds the program.\n")
    assert "1 of 3 written" in said.stderr
    (put, where, options), (get, then, _) = asked
    assert (put, where, get, then) == (
        "PUT",
        "http://gate/bodies/3F/program?flash=true",
        "GET",
        f"http://gate{PLACE}",
    )
    assert options["json"] == {"source": BLINK}


@pytest.mark.parametrize("words", [("upload", "3F", "{}"), ("run", "3F", "--wait", "10")])
def test_who_breaks_the_wait_off_is_told_that_it_goes_on(
    words: tuple[str, ...], source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def request(*_: object, **__: object) -> httpx.Response:
        raise KeyboardInterrupt

    monkeypatch.setattr(http, "request", request)
    said = invoke(*(word.format(source) for word in words))
    assert (said.exit_code, "goes on if it was begun" in said.stderr) == (4, True)


def test_an_upload_that_failed_says_what_is_stored(source: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answering(monkeypatch, httpx.Response(200, json=DIFFERS))
    said = invoke("upload", "3F", str(source))
    assert (said.exit_code, said.stdout) == (1, "")
    assert "Line 2: it holds END. RAM holds something else. Upload it again." in said.stderr


def test_a_program_is_downloaded_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = answering(monkeypatch, httpx.Response(200, json={"source": "SET OD0\nEND\n"}))
    assert invoke("download", "3F").stdout == "SET OD0\nEND\n"
    assert asked[0][2]["timeout"] > 600


@pytest.mark.parametrize(
    ("status", "cause", "wait", "code"),
    [
        ("running", None, "0", 0),
        ("running", None, "5", 5),
        ("ended", "normal", "5", 0),
        ("ended", "single_step", "5", 0),
        ("ended", "stopped", "5", 1),
        ("unknown", None, "5", 4),
    ],
)
def test_the_end_of_a_run_is_an_exit_code(
    status: str, cause: str | None, wait: str, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    answer = httpx.Response(202, json={"status": status, "end_cause": cause})
    asked = answering(monkeypatch, answer)
    assert invoke("run", "3F", "--label", "BLINK", "--wait", wait).exit_code == code
    assert asked[0][2]["json"] == {"label": "BLINK", "address": None, "single_step": False}


@pytest.mark.parametrize(
    ("status", "problem", "code"),
    [
        (409, {"detail": "The motor moves.", "moved": "no"}, 1),
        (409, {"detail": "No reply.", "moved": "unknown"}, 4),
        (404, {"detail": "There is no body 3F."}, 2),
        (422, {"detail": "Nothing stands there.", "code": "0x5B"}, 1),
        (503, {"detail": "The line is down."}, 3),
        (502, ["a proxy"], 4),
    ],
)
def test_a_problem_is_told_in_its_sentence(
    status: int, problem: Any, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    answering(monkeypatch, httpx.Response(status, json=problem))
    said = invoke("run", "3F")
    assert (said.exit_code, said.stdout) == (code, "")
    assert (problem["detail"] if isinstance(problem, dict) else "502") in said.stderr


def test_without_a_gateway_nothing_is_sent(source: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def nobody(*_: object, **__: object) -> httpx.Response:
        raise http.NotReached("refused")

    monkeypatch.setattr(http, "request", nobody)
    assert invoke("upload", "3F", str(source)).exit_code == 3


def test_a_body_is_named_as_the_configuration_does(monkeypatch: pytest.MonkeyPatch) -> None:
    gateway = FakeGateway(plant(b3F="lift"))
    gateway.answers["/bodies/a.3F/program"] = [(200, {"source": "END\n"})]
    assert gateway.run(monkeypatch, "program", "download", "lift").stdout == "END\n"


def test_a_robot_has_no_program(monkeypatch: pytest.MonkeyPatch) -> None:
    said = FakeGateway(plant()).run(monkeypatch, "program", "download", "r1")
    assert said.exit_code == 2
    assert "is no body" in said.stderr
