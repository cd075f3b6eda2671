"""The command line's part for journals."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from app.cli import app
from gateway.core.journal import writes
from gateway.core.journal.disk import SqliteDisk
from tests.gateway.core.journal.old_files import file_of


def run(*words: object) -> Result:
    return CliRunner().invoke(app, ["journal", *map(str, words)])


@pytest.fixture
def data(tmp_path: Path) -> Iterator[Path]:
    disk = SqliteDisk(tmp_path)
    disk.commit(
        [writes.event(number, 1.0, "line.up", "/lines/a", "{}") for number in (1, 2, 3)], durable=True
    )
    yield tmp_path
    disk.close()


def test_a_sound_journal_is_called_sound(data: Path) -> None:
    said = run("verify", "--data", data)
    assert (said.exit_code, said.output) == (0, "The journal is sound.\n")


def test_a_broken_journal_is_told_with_an_exit_code(tmp_path: Path) -> None:
    (tmp_path / "journal.db").write_bytes(b"x" * 5000)
    said = run("verify", "--data", tmp_path)
    assert said.exit_code == 1
    assert "not a database" in said.output
    assert run("export", "--data", tmp_path).exit_code == 1


def test_where_there_is_none_that_is_said(tmp_path: Path) -> None:
    said = run("verify", "--data", tmp_path)
    assert (said.exit_code, said.stderr) == (2, f"There is no journal in {tmp_path}.\n")


def test_every_entry_is_a_line_of_json(data: Path) -> None:
    rows = [json.loads(line) for line in run("export", "--data", data).output.splitlines()]
    assert [row["number"] for row in rows if row["table"] == "events"] == [1, 2, 3]


def test_a_copy_is_made_once(data: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy.db"
    assert run("backup", copy, "--data", data).exit_code == 0
    again = run("backup", copy, "--data", data)
    assert (again.exit_code, "exists already" in again.stderr) == (2, True)


def test_a_copy_to_nowhere_is_told(data: Path, tmp_path: Path) -> None:
    nowhere = tmp_path / "none" / "copy.db"
    said = run("backup", nowhere, "--data", data)
    told = f"There is no directory {nowhere.parent}; nothing was written.\n"
    assert (said.exit_code, said.stderr) == (2, told)


def test_what_is_too_much_is_forgotten_and_a_gateway_that_runs_is_told(data: Path) -> None:
    said = run("prune", "--events", 1, "--data", data)
    assert said.exit_code == 0
    assert said.output.startswith("2 entries were forgotten.\nA gateway runs on this journal: the file keeps")


def test_a_journal_of_an_earlier_version_is_sound_and_pruned_by_its_own(tmp_path: Path) -> None:
    file_of(3, tmp_path)
    said = run("verify", "--data", tmp_path)
    assert said.exit_code == 0
    assert said.output.startswith("The journal is sound.\nIts tables are of version 3; the next start")
    refused = run("prune", "--data", tmp_path)
    assert (refused.exit_code, "nothing was forgotten" in refused.stderr) == (1, True)
