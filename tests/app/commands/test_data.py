"""A data directory is copied while a gateway has it, and brought back as it was."""

import tarfile
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from app.cli import app
from app.commands import data as data_command
from gateway.access.keys import KeyStore
from gateway.access.roles import Role
from gateway.core.journal import files, writes
from gateway.core.journal.disk import SqliteDisk
from gateway.security import chain
from gateway.security.entries import KEY_MADE

GZIP_HEAD = 10
"""Bytes of a gzip file before its content: no checksum holds for its time."""


def run(*words: object) -> Result:
    return CliRunner().invoke(app, ["data", *map(str, words)])


@pytest.fixture
def data(tmp_path: Path) -> Iterator[Path]:
    """The directory of a gateway that runs."""
    directory = tmp_path / "data"
    disk = SqliteDisk(directory)
    disk.commit([writes.event(1, 1.0, "line.up", "/lines/a", "{}")], durable=True)
    yield directory
    disk.close()


@pytest.fixture
def copied(data: Path, tmp_path: Path) -> Path:
    target = tmp_path / "copy.tar.gz"
    said = run("backup", target, "--data", data)
    assert said.exit_code == 0, said.output
    return target


def test_all_is_there_again_and_private(data: Path, tmp_path: Path) -> None:
    token = KeyStore(data).create("mes", Role.OPERATOR)
    chain.Chain(data).append([chain.draft(KEY_MADE.name, "mes")])
    assert run("backup", tmp_path / "copy", "--data", data).exit_code == 0
    said = run("restore", tmp_path / "copy", "--data", tmp_path / "again")
    assert said.exit_code == 0, said.output
    assert "revoke it anew" in said.stdout
    again = tmp_path / "again"
    assert KeyStore(again).verify(token) is not None
    assert chain.verify(again) == chain.verify(data)
    assert [row for row in files.export(again) if row["table"] == "events"]
    places = [again, *again.rglob("*"), tmp_path / "copy"]
    assert {place.stat().st_mode & 0o077 for place in places} == {0}
    SqliteDisk(again).close()


def test_nightly_backups_and_recordings_are_copied_and_what_is_linked_is_not(
    data: Path, tmp_path: Path
) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "secret").write_text("not ours", "utf-8")
    (data / "linked").symlink_to(tmp_path / "elsewhere")
    kept = {"backups/line1/2026-11-27.backup": b"[body 3F]\n", "recordings/alarm.mgrec": bytes(100_000)}
    for name, content in kept.items():
        (data / name).parent.mkdir(parents=True)
        (data / name).write_bytes(content)
    assert run("backup", tmp_path / "copy", "--data", data).exit_code == 0
    assert run("restore", tmp_path / "copy", "--data", tmp_path / "again").exit_code == 0
    again = tmp_path / "again"
    assert {name: (again / name).read_bytes() for name in kept} == kept
    assert not (again / "linked").exists()


def test_a_copy_is_made_once(copied: Path, data: Path) -> None:
    before = copied.read_bytes()
    said = run("backup", copied, "--data", data)
    assert (said.exit_code, "exists already; nothing was written" in said.stderr) == (2, True)
    assert copied.read_bytes() == before


def test_what_is_killed_in_the_middle_leaves_nothing_that_looks_like_a_copy(
    data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[bool] = []

    def write(*args: Any) -> None:
        seen.append((tmp_path / "copy").exists())
        raise MemoryError

    monkeypatch.setattr(data_command, "_write", write)
    assert run("backup", tmp_path / "copy", "--data", data).exit_code != 0
    assert seen == [False]
    assert [path for path in tmp_path.iterdir() if "copy" in path.name] == []


def test_where_there_is_no_directory_nothing_is_written(tmp_path: Path) -> None:
    said = run("backup", tmp_path / "copy", "--data", tmp_path / "nowhere")
    assert (said.exit_code, "There is no directory" in said.stderr) == (2, True)
    assert not (tmp_path / "copy").exists()


def test_data_that_is_there_is_not_replaced(copied: Path, data: Path) -> None:
    said = run("restore", copied, "--data", data)
    assert (said.exit_code, "is not empty; nothing was changed" in said.stderr) == (2, True)


def archive(path: Path, **members: bytes) -> Path:
    with tarfile.open(path, "w:gz") as made:
        for name, content in members.items():
            member = tarfile.TarInfo(name)
            member.size = len(content)
            made.addfile(member, BytesIO(content))
    return path


@pytest.mark.parametrize(
    ("members", "why"),
    [
        ({"journal.db": b"x" * 5000}, "is not sound"),
        ({"keys.json": b"{}"}, "is no copy of a data directory"),
        ({"../out": b"x"}, "outside the destination"),
    ],
)
def test_what_is_no_copy_is_refused_and_leaves_nothing(
    members: dict[str, bytes], why: str, tmp_path: Path
) -> None:
    place = tmp_path / "place"
    said = run("restore", archive(tmp_path / "odd", **members), "--data", place / "data")
    assert said.exit_code != 0
    assert why in said.stderr
    assert list(place.iterdir()) == []


@pytest.mark.parametrize("kind", [tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.FIFOTYPE])
def test_a_copy_holds_files_and_folders_alone(kind: bytes, tmp_path: Path) -> None:
    place = tmp_path / "place"
    with tarfile.open(tmp_path / "odd", "w:gz") as made:
        member = tarfile.TarInfo("keys.json")
        member.type, member.linkname = kind, "/etc/passwd"
        made.addfile(member)
    said = run("restore", tmp_path / "odd", "--data", place / "data")
    assert (said.exit_code, "keys.json" in said.stderr) == (2, True)
    assert list(place.iterdir()) == []


@pytest.mark.parametrize("cut", [0, 20, 200])
def test_a_file_that_was_cut_off_is_refused(copied: Path, cut: int, tmp_path: Path) -> None:
    copied.write_bytes(copied.read_bytes()[:cut])
    said = run("restore", copied, "--data", tmp_path / "again")
    assert said.exit_code == 2, said.output
    assert not (tmp_path / "again").exists()


def test_a_file_in_which_a_bit_has_flipped_is_refused(copied: Path, tmp_path: Path) -> None:
    """A byte of the name of a key, say, would be found by nothing but the checksum."""
    whole, place = copied.read_bytes(), tmp_path / "place"
    for at in range(GZIP_HEAD, len(whole), max(1, len(whole) // 40)):
        copied.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
        said = run("restore", copied, "--data", place / "data")
        assert said.exit_code in (1, 2), at
        assert "othing was changed" in said.stderr
        assert list(place.iterdir()) == []
