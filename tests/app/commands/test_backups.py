"""Backups on the command line: files, differences as people read them, exit codes that scripts can use."""

from pathlib import Path
from typing import Any

import pytest

from tests.app.fake_gateway import Answer, FakeGateway, plant

TEXT = "[body 3F]\n[settings]\n0SS25\n"
LINES = {"lines": [{"line_id": "arm", "protocol": "rorze"}, {"line_id": "cell", "protocol": "fics"}]}
DIFFERENCE = {
    "target": "arm.3F",
    "section": "settings",
    "name": "origin offset",
    "wanted": "0SS25",
    "held": None,
    "restorable": False,
}
PATH = "/bodies/3F/restores"
COMPARISONS = "/bodies/3F/comparisons"


def record(status: str, differences: list[Any] | None = None, **more: Any) -> dict[str, Any]:
    return {
        "id": "7",
        "target": "/bodies/arm.3F",
        "controllers": ["arm.3F"],
        "status": status,
        "phase": "saving",
        "read": 9,
        "written": 1,
        "commands": 1,
        "flash": False,
        "saved": False,
        "error": None,
        "differences": differences,
        "left_s": None,
        **more,
    }


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "lift.txt"
    path.write_text(TEXT)
    return path


def reading(path: str, status: str, **more: Any) -> dict[str, Any]:
    return {
        "id": "8",
        "target": path,
        "status": status,
        "controller": "arm.3F",
        "read": 40,
        "expected": 2400,
        "text": None,
        "left_s": 75.4,
        "differing": None,
        "restore_s": 210.0,
        "baud": 9600,
        "error": None,
        **more,
    }


def backups(path: str) -> dict[str, list[Answer]]:
    over = reading(path, "succeeded", text=TEXT)
    running = reading(path, "running")
    return {f"{path}/backups": [(202, running)], f"{path}/backups/8": [(200, running), (200, over)]}


def test_a_backup_is_printed_or_written_to_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gateway = FakeGateway(backups("/bodies/3F"))
    assert gateway.run(monkeypatch, "backup", "3f").stdout == TEXT
    assert gateway.paths == ["/bodies/3F/backups", "/bodies/3F/backups/8", "/bodies/3F/backups/8"]
    said = gateway.run(monkeypatch, "backup", "3F", str(tmp_path / "new"))
    assert (said.exit_code, said.stdout, (tmp_path / "new").read_text()) == (0, "", TEXT)
    assert gateway.run(monkeypatch, "backup", "3F", str(tmp_path)).exit_code == 2


def test_a_backup_that_is_not_read_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    error = {"detail": "Body 3F does not answer; nothing was sent.", "remedy": "Check its power and cable."}
    failed = reading("/bodies/3F", "failed", error=error)
    said = FakeGateway({"/bodies/3F/backups": [(200, failed)]}).run(monkeypatch, "backup", "3F")
    assert (said.exit_code, said.stdout) == (1, "")
    assert "does not answer; nothing was sent. Check its power" in said.stderr


def test_who_interrupts_a_backup_ends_it_at_the_gateway(monkeypatch: pytest.MonkeyPatch) -> None:
    gateway = FakeGateway(backups("/bodies/3F"))
    gateway.answers["/bodies/3F/backups/8"] = [(200, KeyboardInterrupt())]
    gateway.answers["/bodies/3F/backups/current"] = [(200, reading("/bodies/3F", "cancelled"))]
    assert gateway.run(monkeypatch, "backup", "3F").exit_code != 0
    assert (gateway.asked[-1].method, gateway.paths[-1]) == ("DELETE", "/bodies/3F/backups/current")


def test_lines_and_robots_have_backups_and_groups_and_units_have_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    answers = plant() | {"/lines": [(200, LINES)]}
    gateway = FakeGateway({**answers, **backups("/lines/arm"), **backups("/robots/r1")})
    for word in ("arm", "r1"):
        assert gateway.run(monkeypatch, "backup", word).stdout == TEXT
    assert gateway.run(monkeypatch, "backup", "arm", "--body", "3F").stdout == TEXT
    for word in ("80", "r1/units/2", "cell"):
        assert gateway.run(monkeypatch, "backup", word).exit_code == 2


def comparison(differences: list[Any], *commands: str) -> dict[str, Any]:
    return reading("/bodies/3F", "succeeded", commands=list(commands), differences=differences)


def test_what_differs_is_told_line_by_line(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[Answer] = [(202, reading("/bodies/3F", "running")), (200, comparison([]))]
    ended: list[Answer] = [(200, comparison([DIFFERENCE]))]
    gateway = FakeGateway({COMPARISONS: begun, f"{COMPARISONS}/8": ended})
    said = gateway.run(monkeypatch, "diff", "3F", str(file), "--from", "40")
    told = "arm.3F settings: origin offset: backup 0SS25, holds nothing; no command can change that\n"
    assert (said.exit_code, said.stdout) == (1, told)
    assert gateway.posted == [(COMPARISONS, {"backup": TEXT, "from_body": "40"})]
    assert gateway.run(monkeypatch, "diff", "3F", str(file)).exit_code == 0


def test_a_night_stands_for_a_file_and_what_differs_is_summed_up(monkeypatch: pytest.MonkeyPatch) -> None:
    counts = {"settings": 14, "positions": 37, "program": 1}
    gateway = FakeGateway({COMPARISONS: [(200, comparison([DIFFERENCE]) | {"differing": counts})]})
    said = gateway.run(monkeypatch, "diff", "3F", "--nightly", "last", "--without", "memories")
    assert gateway.posted == [(COMPARISONS, {"nightly": "last", "without": ["memories"]})]
    assert "Differs from the backup in 14 settings, 37 positions, 1 program." in said.stderr
    assert "A restore takes 3 min 30 s at 9600 baud. At 38400 baud it takes less than half" in said.stderr
    for words in (("diff", "3F"), ("restore", "3F", "some.backup", "--nightly", "last")):
        assert gateway.run(monkeypatch, *words).exit_code == 2


def test_who_interrupts_a_comparison_ends_it_at_the_gateway(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gateway = FakeGateway(
        {
            COMPARISONS: [(202, reading("/bodies/3F", "running"))],
            f"{COMPARISONS}/8": [(200, KeyboardInterrupt())],
            f"{COMPARISONS}/current": [(200, reading("/bodies/3F", "cancelled"))],
        }
    )
    assert gateway.run(monkeypatch, "diff", "3F", str(file)).exit_code != 0
    assert (gateway.asked[-1].method, gateway.paths[-1]) == ("DELETE", f"{COMPARISONS}/current")


def test_a_dry_run_prints_the_exact_commands(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gateway = FakeGateway({COMPARISONS: [(200, comparison([DIFFERENCE], "&3F0SS25"))]})
    said = gateway.run(monkeypatch, "restore", "3F", str(file), "--dry-run")
    assert (said.exit_code, said.stdout.splitlines()[0]) == (0, "&3F0SS25")
    assert "no command can change that" in said.stdout


def test_another_scale_is_told_with_what_was_made_of_it(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scale = {"target": "arm.3F", "backup": "100 pulses/mm", "controller": "250 pulses/mm", "units": "convert"}
    gateway = FakeGateway({COMPARISONS: [(200, {**comparison([], "&3F0SS25"), "scales": [scale]})]})
    said = gateway.run(monkeypatch, "restore", "3F", str(file), "--dry-run", "--units", "convert")
    assert gateway.posted[0][1] == {"backup": TEXT, "units": "convert"}
    assert said.stderr == "arm.3F: backup 100 pulses/mm, body 250 pulses/mm; lengths are converted.\n"


def test_a_restore_is_followed_to_its_end(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gateway = FakeGateway(
        {
            PATH: [(202, record("running"))],
            "/bodies/arm.3F/restores/7": [
                (200, record("running")),
                (200, record("verified", [], saved=True)),
            ],
        }
    )
    said = gateway.run(monkeypatch, "restore", "3F", str(file), "--flash")
    assert said.stdout == "arm.3F: flash memory and RAM hold the backup, read back.\n"
    assert gateway.posted[0][1] == {"backup": TEXT, "flash": True, "power_cycle": False}
    assert len(gateway.paths) == 3


def test_who_breaks_the_wait_for_a_restore_off_is_told_that_it_goes_on(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gateway = FakeGateway(
        {PATH: [(202, record("running"))], "/bodies/arm.3F/restores/7": [(200, KeyboardInterrupt())]}
    )
    said = gateway.run(monkeypatch, "restore", "3F", str(file))
    assert (said.exit_code, "the restore goes on if it was begun" in said.stderr) == (4, True)


@pytest.mark.parametrize(("commands", "words"), [(0, "9 read\n"), (4, "9 read, 1 of 4 written\n")])
def test_the_progress_of_a_restore_counts_commands_where_there_are_any(
    file: Path, monkeypatch: pytest.MonkeyPatch, commands: int, words: str
) -> None:
    monkeypatch.setattr("app.output.QUIET_S", 0.0)
    running, over = record("running", phase="comparing", commands=commands), record("verified", [])
    answers: dict[str, list[Answer]] = {PATH: [(202, running)], "/bodies/arm.3F/restores/7": [(200, over)]}
    said = FakeGateway(answers).run(monkeypatch, "restore", "3F", str(file))
    assert f"comparing: {words}" in said.stderr


@pytest.mark.parametrize(
    ("over", "code", "words"),
    [
        (record("verified", []), 0, "RAM holds the backup"),
        (record("differs", [DIFFERENCE]), 1, "differs: 1 differences."),
        (
            record("cancelled", [], error={"detail": "A stop came first.", "remedy": "Again."}),
            1,
            "A stop came first.",
        ),
        (
            record("failed", [], flash=True, error={"detail": "It does not answer.", "remedy": "Look."}),
            1,
            "nothing differs from the backup, but the end of the writing of flash memory was not seen.",
        ),
        (
            record("failed", None, error={"detail": "No reply.", "remedy": "Look."}),
            4,
            "nobody knows what arm.3F",
        ),
    ],
)
def test_the_end_of_a_restore_is_an_exit_code(
    over: dict[str, Any], code: int, words: str, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = FakeGateway({PATH: [(200, over)]}).run(monkeypatch, "restore", "3F", str(file))
    assert (said.exit_code, words in said.output) == (code, True)


def test_a_gateway_that_goes_leaves_the_end_unknown(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gateway = FakeGateway({PATH: [(202, record("running"))]}, (503, {"detail": "Down."}))
    said = gateway.run(monkeypatch, "restore", "3F", str(file))
    assert (said.exit_code, "The restore 7 was begun" in said.output) == (4, True)


def test_what_cannot_be_read_is_no_backup(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    garbled, gateway = tmp_path / "garbled", FakeGateway()
    garbled.write_bytes(b"\xff")
    for path in (garbled, tmp_path, tmp_path / "nothing"):
        assert gateway.run(monkeypatch, "diff", "3F", str(path)).exit_code == 2
    assert not gateway.asked
