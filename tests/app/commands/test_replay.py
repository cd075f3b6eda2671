"""`replay`: a recording is done again, and the first difference ends it with 1 and its record."""

import logging
import zipfile
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

import pytest
from typer.testing import CliRunner

from app.cli import app
from gateway.plant import Plant
from recordings import replaying
from tests.recordings.scripts import BODIES
from tests.recordings.taking import bodies_at_work


@pytest.fixture(autouse=True)
def _slow_wire() -> Iterator[None]:
    """The recorded cable was one of 9600 baud, which its made-up address does not say."""
    with patch.object(replaying.Replay.__init__, "__defaults__", (lambda *_: (10 / 9600, False), Plant)):
        yield
    logging.disable(logging.NOTSET)


@pytest.fixture(name="recording", scope="module")
def _recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return bodies_at_work(tmp_path_factory.mktemp("recording"), BODIES[:9])


def replay(*words: object) -> tuple[int, str, str]:
    said = CliRunner().invoke(app, ["replay", *map(str, words)])
    return said.exit_code, said.stdout, said.stderr


def with_byte(recording: Path, target: Path, old: bytes, new: bytes) -> int:
    """Change what a line of lines/line1.jsonl has; give its number."""
    with zipfile.ZipFile(recording) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    lines = members["lines/line1.jsonl"].splitlines(keepends=True)
    place = next(number for number, line in enumerate(lines) if old in line)
    lines[place] = lines[place].replace(old, new)
    members["lines/line1.jsonl"] = b"".join(lines)
    with zipfile.ZipFile(target, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return place + 1


def test_no_difference_ends_with_0(recording: Path) -> None:
    code, stdout, stderr = replay(recording, "--lines", "--speed", "max")
    assert (code, stderr) == (0, "")
    assert stdout.startswith("No difference: ")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"&00OHS50000", b"&00OHS50001"),
        (b"&01OSS100000", b"&02OSS100000"),
        (b'"tx","data":"&3F6PD', b'"tx","data":"&3F6QD'),
    ],
)
def test_one_changed_byte_ends_with_1_and_its_record(
    old: bytes, new: bytes, recording: Path, tmp_path: Path
) -> None:
    number = with_byte(recording, tmp_path / "a.mgrec", old, new)
    code, _, stderr = replay(tmp_path / "a.mgrec", "--lines")
    assert code == 1
    assert f"lines/line1.jsonl:{number}: " in stderr


def test_a_record_that_cannot_be_read_ends_with_1_and_its_place(recording: Path, tmp_path: Path) -> None:
    number = with_byte(recording, tmp_path / "a.mgrec", b'"kind":"tx"', b'"kind":"ty"')
    code, _, stderr = replay(tmp_path / "a.mgrec", "--lines")
    assert code == 1
    assert f"lines/line1.jsonl:{number}: " in stderr


def test_a_dialogue_is_written_beside_it(recording: Path) -> None:
    code, stdout, _ = replay(recording, "--as-test")
    assert code == 0
    dialogue = recording.with_suffix(".dialogue")
    assert str(dialogue) in stdout
    assert dialogue.read_text().startswith("motion-gateway dialogue 1\n")


@pytest.mark.parametrize(
    "words", [(), ("--lines", "--serve"), ("--lines", "--speed", "0"), ("--lines", "--speed", "fast")]
)
def test_a_wrong_question_ends_with_2(words: tuple[str, ...], recording: Path) -> None:
    assert replay(recording, *words)[0] == 2
