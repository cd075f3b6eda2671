"""The security log in its files: every change of it shows, and no end of the gateway spoils it."""

import errno
import json
import os
import re
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from gateway.security import chain as chain_module
from gateway.security.chain import FOLDER, Chain, draft, newest, verify


def written(data: Path, count: int = 5) -> Chain:
    it = Chain(data)
    for number in range(1, count + 1):
        it.append([draft("key.made", f"key{number}")])
    return it


def file_of(data: Path) -> Path:
    [file] = (data / FOLDER).glob("entries-*.jsonl")
    return file


def change(data: Path, how: Callable[[list[bytes]], list[bytes]]) -> None:
    file = file_of(data)
    file.write_bytes(b"".join(how(file.read_bytes().splitlines(keepends=True))))


def targets(data: Path) -> list[str]:
    return [it.target for it in newest(data, 100)]


def test_what_is_written_is_read_newest_first_and_holds(tmp_path: Path) -> None:
    written(tmp_path)
    assert targets(tmp_path) == ["key5", "key4", "key3", "key2", "key1"]
    assert [it.number for it in newest(tmp_path, 2, before=4)] == [3, 2]
    verdict = verify(tmp_path)
    assert (verdict.fault, verdict.first, verdict.head.number, verdict.torn) == (None, 1, 5, False)
    assert file_of(tmp_path).stat().st_mode & 0o777 == 0o600


def _edited(lines: list[bytes]) -> list[bytes]:
    return [line.replace(b"key3", b"keyX") for line in lines]


@pytest.mark.parametrize(
    ("how", "said"),
    [
        (_edited, "Entry 3 .* was changed"),
        (lambda it: [*it[:2], *it[3:]], "Entry 4 .* comes after 2"),
        (lambda it: [it[0], it[2], it[1], *it[3:]], "Entry 3 .* comes after 1"),
        (lambda it: [*it[:3], it[2], *it[3:]], "Entry 3 .* comes after 3"),
        (lambda it: it[2:], "Entry 3 is the first, and no entry says"),
        (lambda it: it[:3], "Entry 3 is the last, and 5 was written"),
        (lambda it: [*it[:2], b"{}\n", *it[2:]], "line 3: it is no entry"),
        (lambda _: [], "Entry 0 is the last, and 5 was written"),
    ],
)
def test_every_change_is_told_with_the_first_entry_that_does_not_hold(
    tmp_path: Path, how: Callable[[list[bytes]], list[bytes]], said: str
) -> None:
    written(tmp_path)
    change(tmp_path, how)
    fault = verify(tmp_path).fault
    assert fault is not None
    assert re.search(said, fault), fault


def test_an_entry_that_is_forged_with_its_hash_breaks_the_next(tmp_path: Path) -> None:
    written(tmp_path)
    other = tmp_path / "other"
    forged = Chain(other)
    for name in ("key1", "key2", "somebody else"):
        forged.append([draft("key.made", name)])
    line = file_of(other).read_bytes().splitlines(keepends=True)[2]
    change(tmp_path, lambda it: [*it[:2], line, *it[3:]])
    assert "Entry 3" in str(verify(tmp_path).fault)


def test_a_forged_tail_shows_by_a_head_that_was_kept_elsewhere(tmp_path: Path) -> None:
    """A chain alone cannot show it: who can write the files can forge all of them."""
    it = written(tmp_path)
    kept = str(verify(tmp_path).head)
    change(tmp_path, lambda lines: lines[:3])
    (tmp_path / FOLDER / "head").unlink()
    assert verify(tmp_path).fault is None
    assert f"No entry is {kept}" in str(verify(tmp_path, kept).fault)
    it.append([draft("key.made", "key6")])
    assert "no entry" not in str(verify(tmp_path).fault).lower()
    assert verify(tmp_path).fault is not None  # the gateway that runs has not forgotten where it was


def test_a_gateway_killed_at_any_byte_leaves_a_log_that_is_mended(tmp_path: Path) -> None:
    written(tmp_path, 2)
    file = file_of(tmp_path)
    whole = file.read_bytes()
    head = tmp_path / FOLDER / "head"
    first = whole.index(b"\n") + 1
    digest = json.loads(whole[: first - 1])["hash"]
    for end in range(first, len(whole)):
        file.write_bytes(whole[:end])
        head.write_text(f"{1:020} {digest}\n")
        verdict = verify(tmp_path)
        assert (verdict.fault, verdict.head.number, verdict.torn) == (None, 1, end > first)
        Chain(tmp_path).append([draft("gateway.started")])
        verdict = verify(tmp_path)
        assert (verdict.fault, verdict.torn) == (None, False)
        told = [(it.type, it.data) for it in reversed(newest(tmp_path, 10))][1:]
        torn = whole[first:end].decode()
        mended = [("log.mended", {"text": torn})] if torn else []
        assert told == [*mended, ("gateway.started", {})]


def test_a_full_disk_takes_all_or_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    it = written(tmp_path)
    write = os.write

    def half(descriptor: int, text: bytes) -> int:
        if len(text) < 100:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(descriptor, text[: len(text) - 50])

    monkeypatch.setattr(os, "write", half)
    with pytest.raises(OSError, match="No space"):
        it.append([draft("key.made", "key6")])
    monkeypatch.undo()
    assert verify(tmp_path).head.number == 5
    it.append([draft("key.made", "key6")])
    assert (verify(tmp_path).fault, targets(tmp_path)[0]) == (None, "key6")


def test_two_processes_make_one_chain(tmp_path: Path) -> None:
    gateway, command_line = Chain(tmp_path), Chain(tmp_path)
    for number in range(6):
        [gateway, command_line][number % 2].append([draft("key.made", f"key{number}")])
    verdict = verify(tmp_path)
    assert (verdict.fault, verdict.head.number) == (None, 6)


def test_what_cuts_the_log_off_while_the_gateway_runs_is_told(tmp_path: Path) -> None:
    it = written(tmp_path)
    change(tmp_path, lambda lines: lines[:2])
    (tmp_path / FOLDER / "head").unlink()
    it.append([draft("key.made", "key6")])
    last, changed, *_ = newest(tmp_path, 10)
    assert (last.target, last.number, changed.type) == ("key6", 7, "log.changed")
    assert "ends with entry 2, and 5 was written" in changed.data["why"]
    assert "comes after 2" in str(verify(tmp_path).fault)


def test_what_is_old_is_forgotten_and_the_chain_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(chain_module, "FILE_BYTES", 500)
    it = written(tmp_path, 9)
    files = sorted((tmp_path / FOLDER).glob("entries-*"))
    assert len(files) == 5
    now = datetime.now(UTC)
    assert it.forget(now - timedelta(days=1)) is None
    for _ in range(2):
        assert it.forget(now + timedelta(seconds=1)) is not None
    verdict = verify(tmp_path)
    assert (verdict.fault, verdict.first) == (None, 5)
    assert newest(tmp_path, 1)[0].type == "log.pruned"
    files[2].unlink()
    assert "no entry says that those before it were forgotten" in str(verify(tmp_path).fault)


def test_a_gateway_killed_between_saying_so_and_forgetting_leaves_a_chain_that_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(chain_module, "FILE_BYTES", 500)
    it = written(tmp_path, 9)

    def be_killed(_: Path) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as killed:
        killed.setattr(Path, "unlink", be_killed)
        with pytest.raises(KeyboardInterrupt):
            it.forget(datetime.now(UTC) + timedelta(seconds=1))
    assert verify(tmp_path).fault is None


def test_a_link_in_the_place_of_the_file_is_not_followed(tmp_path: Path) -> None:
    written(tmp_path)
    file = file_of(tmp_path)
    file.rename(tmp_path / "elsewhere")
    file.symlink_to(tmp_path / "elsewhere")
    before = (tmp_path / "elsewhere").read_bytes()
    Chain(tmp_path).append([draft("key.made", "key6")])
    assert (tmp_path / "elsewhere").read_bytes() == before
    assert verify(tmp_path).fault is not None
