"""A journal at the start: another gateway's is left alone, and one that cannot be used says so."""

import asyncio
import errno
import os
import shutil
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import NoReturn
from unittest.mock import patch

import pytest

from gateway.core.journal import journal as module
from gateway.core.journal import writes
from gateway.core.journal.disk import DiskFailed, InUse, NotWritable, SqliteDisk
from gateway.core.journal.journal import JournalUnavailable
from gateway.core.journal.opening import longest_s, open_journal
from gateway.core.journal.schema import VERSION
from gateway.core.journal.writes import Write, meta
from tests.gateway.core.journal.full_disk import no_room_beyond
from tests.gateway.core.journal.old_files import file_of


def event(number: int) -> Write:
    return writes.event(number, 1.0, "line.up", "/lines/a", f"{{{number}}}")


def test_a_large_journal_is_known_to_take_long_before_it_is_opened(tmp_path: Path) -> None:
    assert longest_s(tmp_path) == 0
    for name, mebibytes in (("journal.db", 1000), ("journal.db-wal", 24)):
        with (tmp_path / name).open("wb") as file:
            file.truncate(mebibytes << 20)
    assert longest_s(tmp_path) == 512


def test_another_gateways_journal_is_left_alone(tmp_path: Path) -> None:
    first = open_journal(tmp_path)
    with pytest.raises(InUse, match="another gateway"):
        open_journal(tmp_path)
    first.journal.disk.close()


def test_one_that_cannot_be_used_takes_nothing(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "file").write_text("in the way")
    journal, past, set_aside = open_journal(tmp_path / "file")
    assert (past.last_event, past.was_clean, set_aside) == (0, True, None)
    assert "only reads and stops are sent" in caplog.text
    with pytest.raises(JournalUnavailable, match="nothing was sent") as refused:
        journal.require()
    assert "restart the gateway" in refused.value.remedy
    with pytest.raises(DiskFailed):
        journal.disk.commit([meta("a", "b")], durable=True)


@pytest.mark.anyio
async def test_a_life_that_begins_on_a_full_disk_knows_the_past_and_writes_when_there_is_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "CHECK_S", 0.005)
    before = open_journal(tmp_path)
    before.journal.disk.close()  # as a crash does, it does not mark its end
    is_full = True
    commit = SqliteDisk.commit

    def takes(disk: SqliteDisk, writes: Sequence[Write], *, durable: bool) -> None:
        if is_full:
            raise NotWritable("no space left on device")
        commit(disk, writes, durable=durable)

    monkeypatch.setattr(SqliteDisk, "commit", takes)
    journal, past, _ = open_journal(tmp_path)
    assert (past.was_clean, list(past.earlier)) == (False, [before.past.epoch])
    with pytest.raises(JournalUnavailable, match="no space left"):
        journal.require()
    recovered = asyncio.Event()
    journal.on_trouble = lambda why: recovered.set() if why is None else None
    journal.start()
    is_full = False
    await recovered.wait()
    journal.require()
    assert dict(await journal.rows("SELECT name, value FROM meta"))["epoch"] == past.epoch
    await journal.close()


def no_room() -> AbstractContextManager[object]:
    """No file can grow, as on a full disk."""
    return no_room_beyond(0)


@contextmanager
def read_only() -> Iterator[None]:
    """No file can be made or written, as on a file system that is mounted so."""

    def refuse(*_: object, **__: object) -> NoReturn:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    with patch.object(os, "open", refuse), patch("gateway.core.journal.disk.TemporaryFile", refuse):
        yield


@pytest.mark.anyio
@pytest.mark.parametrize(
    ("forbid", "why", "before"),
    [
        *(
            (no_room, "No space left", before)
            for before in ("nothing", "a clean end", "a crash", "no journal")
        ),
        *((read_only, "Read-only file system", before) for before in ("nothing", "a clean end", "a crash")),
    ],
)
async def test_a_disk_that_cannot_be_written_at_the_start_is_used_when_it_can(
    forbid: Callable[[], AbstractContextManager[object]],
    why: str,
    before: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if before in ("a clean end", "a crash"):
        await _live_once(tmp_path, killed=before == "a crash")
    elif before == "no journal":
        (tmp_path / "journal.db").write_bytes(b"no journal" * 1000)
    monkeypatch.setattr(module, "CHECK_S", 0.005)  # what looks more often folds while its files are copied
    with forbid():
        journal, past, set_aside = open_journal(tmp_path)
        assert (past.was_clean, past.last_event) == (before != "a crash", 1 if before[:2] == "a " else 0)
        assert (set_aside is None) == (before != "no journal")
        journal.start()
        journal.note(event(past.last_event + 1))
        assert await journal.rows("SELECT count(*) FROM events") == [(past.last_event,)]
        assert journal.disk.read_apart("SELECT count(*) FROM events") == [(past.last_event,)]
        with pytest.raises(JournalUnavailable, match=why) as refused:
            await journal.write(event(past.last_event + 2))
        assert "tries again" in refused.value.remedy
        if forbid is no_room:  # a lock is a file that can be written
            with pytest.raises(InUse):
                open_journal(tmp_path)
    recovered = asyncio.Event()
    journal.on_trouble = lambda why: recovered.set() if why is None else None
    if journal.trouble is not None:
        await recovered.wait()
    await journal.write(event(past.last_event + 2))
    await journal.close()
    after = open_journal(tmp_path)
    assert (after.past.was_clean, after.past.epoch) == (True, past.epoch)
    assert after.past.last_event == past.last_event + 2
    assert (len(after.past.events), after.journal.trouble) == (past.last_event + 2, None)
    after.journal.disk.close()


@pytest.mark.parametrize("version", range(1, VERSION))
def test_the_first_start_of_a_new_version_on_a_full_disk_says_so_and_changes_nothing(
    version: int, tmp_path: Path
) -> None:
    file_of(version, tmp_path)
    with no_room():
        journal, _, set_aside = open_journal(tmp_path)
    assert (set_aside, journal.failed) == (None, True)
    assert f"No space left on device; so its tables, of version {version}, cannot" in str(journal.trouble)
    journal.disk.close()
    after = open_journal(tmp_path)
    assert after.past.last_event == 7
    after.journal.disk.close()


async def _live_once(directory: Path, *, killed: bool) -> None:
    """Leave what a life with one event does: killed, it has folded nothing into the file."""
    journal = open_journal(directory / "before").journal
    journal.start()
    await journal.write(event(1))
    if not killed:
        await journal.close()
    for path in (directory / "before").glob("journal.db*"):
        if not path.name.endswith("-shm"):
            shutil.copy(path, directory)
    if killed:
        await journal.close()


def test_one_that_may_not_be_read_is_told_and_left_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    SqliteDisk(tmp_path).close()
    monkeypatch.setattr(os, "access", lambda *_: False)  # to root all is allowed
    monkeypatch.setattr("gateway.core.journal.disk._open", refuse_as_sqlite_does)
    journal, _, set_aside = open_journal(tmp_path)
    assert set_aside is None
    assert journal.trouble == f"{tmp_path / 'journal.db'}: Permission denied"


def refuse_as_sqlite_does(_: Path) -> NoReturn:
    raise sqlite3.OperationalError("unable to open database file")


def test_a_broken_one_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "journal.db").write_bytes(b"no journal" * 1000)
    journal, _, set_aside = open_journal(tmp_path)
    assert set_aside is not None
    assert set_aside.read_bytes()[:10] == b"no journal"
    assert journal.trouble is None
    journal.disk.close()
