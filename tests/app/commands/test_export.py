"""`export`: a recording for other programs."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from app.cli import app
from recordings.form import SAMPLES, opened
from tests.recordings.taking import bodies_at_work


def export(*words: object) -> tuple[int, str, str]:
    said = CliRunner().invoke(app, ["export", *map(str, words)])
    return said.exit_code, said.stdout, said.stderr


def test_records_and_samples_are_written(tmp_path: Path) -> None:
    recording = bodies_at_work(tmp_path)
    code, stdout, _ = export(recording, "--pcapng", tmp_path / "a.pcapng", "--samples", tmp_path / "a.csv")
    assert code == 0
    assert f"lua_script:{tmp_path / 'a.lua'}" in stdout
    assert (tmp_path / "a.pcapng").read_bytes()[:4] == b"\x0a\x0d\x0d\x0a"
    assert "wtap.USER0" in (tmp_path / "a.lua").read_text()
    with opened(recording) as read:
        assert (tmp_path / "a.csv").read_text() == f"{read.text(SAMPLES)}\n"


@pytest.mark.parametrize(("name", "why"), [("none.mgrec", "No such file"), ("a.mgrec", "is no recording")])
def test_what_cannot_be_read_is_said_in_a_sentence(name: str, why: str, tmp_path: Path) -> None:
    (tmp_path / "a.mgrec").write_text("no zip")
    code, _, stderr = export(tmp_path / name, "--pcapng", tmp_path / "a.pcapng")
    assert code == 2
    assert why in stderr
    assert not (tmp_path / "a.pcapng").exists()


def test_nothing_to_be_written_is_a_wrong_question(tmp_path: Path) -> None:
    assert export(tmp_path / "a.mgrec")[0] == 2


def test_mcap_is_written_with_its_extra(tmp_path: Path) -> None:
    code, stdout, _ = export(bodies_at_work(tmp_path), "--mcap", tmp_path / "a.mcap")
    assert code == 0
    assert f"messages were written to {tmp_path / 'a.mcap'}" in stdout
    assert (tmp_path / "a.mcap").read_bytes().startswith(b"\x89MCAP")


def test_without_the_extra_nothing_is_written_and_it_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.commands.export.find_spec", lambda _: None)
    code, _, stderr = export(tmp_path / "a.mgrec", "--mcap", tmp_path / "a.mcap")
    assert code == 2
    assert "pip install 'motion-gateway[mcap]'" in stderr
    assert not (tmp_path / "a.mcap").exists()
