"""The journal: durable before it returns, in one commit with all that waits, honest about trouble."""

import asyncio
import sqlite3
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager, closing
from pathlib import Path
from threading import Event
from typing import Any

import pytest

from gateway.core.journal import disk as disk_module
from gateway.core.journal import journal as module
from gateway.core.journal import writes
from gateway.core.journal.disk import Disk, DiskFailed, NotWritable, SqliteDisk
from gateway.core.journal.journal import NOTED_WITHIN_S, Journal, JournalUnavailable
from gateway.core.journal.opening import open_journal
from gateway.core.journal.writes import Retention, Value, Write

pytestmark = pytest.mark.anyio


class ShakyDisk:
    """A disk whose next commits fail as they are told."""

    def __init__(self) -> None:
        self.commits: list[tuple[int, bool]] = []
        self.troubles: list[Exception] = []
        self.untidy: Exception | None = None
        self.tidied = 0
        self.may_go_on = Event()
        self.may_go_on.set()

    def commit(self, batch: Sequence[Write], *, durable: bool) -> None:
        self.may_go_on.wait(5.0)
        if self.troubles:
            raise self.troubles.pop(0)
        self.commits.append((len(batch), durable))

    def rows(self, sql: str, values: Sequence[Value] = ()) -> list[tuple[Any, ...]]:
        return [(sql, *values)]

    def read_apart(self, sql: str, values: Sequence[Value] = ()) -> list[tuple[Any, ...]]:
        return [(sql, *values)]

    def check(self) -> None:
        return

    def tidy(self) -> None:
        self.tidied += 1
        if self.untidy is not None:
            raise self.untidy

    def close(self) -> None:
        return


@asynccontextmanager
async def journal_on(disk: Disk) -> AsyncIterator[Journal]:
    it = Journal(disk)
    it.start()
    try:
        yield it
    finally:
        await it.close()


def intent(number: int = 1) -> Write:
    told = {"target": "line1.3F", "command": "1+M", "effect": "motion", "frame": "&3F1+M5\\r"}
    return writes.intent(f"i{number}", 1.0, caller="test", **told)


async def recovery(journal: Journal) -> None:
    while journal.trouble is not None:  # noqa: ASYNC110
        await asyncio.sleep(0.002)


async def test_a_fault_that_nobody_has_foreseen_is_told_at_once_and_the_writer_lives_on() -> None:
    disk = ShakyDisk()
    disk.troubles.append(FileNotFoundError("journal.db-wal"))
    async with journal_on(disk) as journal:
        for _ in range(2):
            with pytest.raises(JournalUnavailable, match=r"FileNotFoundError: journal\.db-wal"):
                await journal.write(intent())
        assert await journal.rows("SELECT 1") == [("SELECT 1",)]
        assert journal.failed


async def test_a_disk_without_room_to_tidy_is_written_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CHECK_S", 0.002)
    disk = ShakyDisk()
    disk.untidy = NotWritable("no room")
    async with journal_on(disk) as journal:
        while disk.tidied < 2:  # noqa: ASYNC110
            await asyncio.sleep(0.002)
        await journal.write(intent())
        assert journal.trouble is None


async def test_a_file_that_is_found_broken_while_it_is_tidied_is_trusted_no_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "CHECK_S", 0.002)
    disk = ShakyDisk()
    disk.untidy = sqlite3.DatabaseError("malformed")
    async with journal_on(disk) as journal:
        while not journal.failed or journal.trouble is None:  # noqa: ASYNC110
            await asyncio.sleep(0.002)
        with pytest.raises(JournalUnavailable, match="DatabaseError: malformed"):
            await journal.write(intent())


async def test_what_was_written_is_there_for_the_next_life(tmp_path: Path) -> None:
    async with journal_on(SqliteDisk(tmp_path)) as journal:
        await journal.write(intent())
        journal.note(writes.ended("i1", 2.0, "succeeded"))
        assert await journal.rows("SELECT id, outcome FROM intents") == [("i1", "succeeded")]
    disk = SqliteDisk(tmp_path)
    assert disk.rows("SELECT outcome FROM intents") == [("succeeded",)]
    disk.close()


async def test_all_that_waits_shares_one_commit() -> None:
    disk = ShakyDisk()
    disk.may_go_on.clear()
    async with journal_on(disk) as journal:
        first = journal.write(intent(0))
        await asyncio.sleep(0)
        others = asyncio.gather(*(journal.write(intent(number)) for number in range(1, 101)))
        await asyncio.sleep(0.02)
        disk.may_go_on.set()
        await first
        await others
    assert len([durable for _, durable in disk.commits if durable]) <= 3


async def test_of_a_row_that_changes_often_the_newest_state_is_written_once(tmp_path: Path) -> None:
    state = "queued"

    def newest() -> Write:
        return writes.move("m1", 1.0, "arm.3F", state, final=False)

    async with journal_on(SqliteDisk(tmp_path)) as journal:
        journal.note_newest("m1", newest)
        state = "sent"
        journal.note_newest("m1", newest)
        assert journal.waiting() == 1
        assert await journal.rows("SELECT record FROM moves") == [("sent",)]
        state = "moving"
        assert await journal.rows("SELECT record FROM moves") == [("sent",)]


async def test_what_nobody_waits_for_does_not_wait_for_the_disk() -> None:
    disk = ShakyDisk()
    async with journal_on(disk) as journal:
        journal.note(intent(1))
        await journal.rows("SELECT 1")
        await journal.write(intent(2))
    assert disk.commits[:2] == [(1, False), (1, True)]


async def test_what_was_noted_shares_the_commit_of_what_is_waited_for() -> None:
    disk = ShakyDisk()
    async with journal_on(disk) as journal:
        journal.note(intent(1))
        await journal.write(intent(2))
        assert disk.commits == [(2, True)]
        await asyncio.sleep(2 * NOTED_WITHIN_S)
        assert len(disk.commits) == 1  # nothing is left of what was noted


async def test_notes_of_one_moment_share_a_commit_which_comes_soon() -> None:
    disk = ShakyDisk()
    async with journal_on(disk) as journal:
        for number in range(10):
            journal.note(intent(number))
        assert journal.waiting() == 1
        while not disk.commits:  # noqa: ASYNC110
            await asyncio.sleep(0.002)
    assert disk.commits[0] == (10, False)


async def test_what_was_noted_comes_before_what_was_written_after_it() -> None:
    disk = ShakyDisk()
    async with journal_on(disk) as journal:
        journal.note(intent(1), intent(2))
        await journal.write(intent(3))
    assert disk.commits[:-1] in ([(3, True)], [(2, False), (1, True)])


async def test_what_was_noted_before_the_start_is_written() -> None:
    disk = ShakyDisk()
    journal = Journal(disk)
    journal.note(intent(1))
    journal.start()
    await journal.rows("SELECT 1")
    await journal.close()
    assert disk.commits[0] == (1, False)


async def test_a_full_disk_refuses_what_has_an_effect_until_there_is_room(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    monkeypatch.setattr(module, "CHECK_S", 0.01)
    told: list[str | None] = []
    disk = ShakyDisk()
    disk.troubles = [NotWritable("journal.db: No space left on device")] * 3
    async with journal_on(disk) as journal:
        journal.on_trouble = told.append
        with pytest.raises(JournalUnavailable, match="No space left") as refused:
            await journal.write(intent())
        assert (refused.value.moved, refused.value.retryable) == ("no", True)
        with pytest.raises(JournalUnavailable) as known:
            journal.require()
        for error in (refused.value, known.value):
            assert ("tries again" in error.remedy, "再試行" in error.remedy_ja) == (True, True)
        await recovery(journal)
        await journal.write(intent())
    assert told == ["journal.db: No space left on device", None]
    assert [record.levelname for record in caplog.records] == ["ERROR", "INFO"]


async def test_a_file_that_another_program_holds_is_written_when_it_is_free(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(module, "CHECK_S", 0.01)
    monkeypatch.setattr(disk_module, "LOCKED_S", 0.01)
    async with journal_on(SqliteDisk(tmp_path)) as journal:
        with closing(sqlite3.connect(tmp_path / "journal.db", isolation_level=None)) as other:
            other.execute("BEGIN IMMEDIATE")
            with pytest.raises(JournalUnavailable, match="another program holds it"):
                await journal.write(intent())
        await recovery(journal)
        await journal.write(intent())


async def test_what_a_full_disk_has_not_taken_is_written_in_its_order_when_there_is_room(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(module, "CHECK_S", 0.01)
    disk = SqliteDisk(tmp_path)
    async with journal_on(disk) as journal:
        journal.writer.retention = Retention(days=100_000)
        await journal.write(intent())
        with monkeypatch.context() as full:
            full.setattr(disk, "_connection", FullConnection())
            journal.note(writes.written("i1", 2.0))
            journal.note(writes.ended("i1", 3.0, "answered"))
            await journal.rows("SELECT 1")
            assert journal.trouble is not None
            with pytest.raises(JournalUnavailable):
                await journal.write(intent(2))
        await recovery(journal)
        assert await journal.rows("SELECT id, written_at, outcome FROM intents") == [("i1", 2.0, "answered")]
    assert was_clean(tmp_path)


async def test_an_end_at_which_something_was_forgotten_is_not_clean(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(module, "CHECK_S", 0.01)
    monkeypatch.setattr(module, "MOST_OWED", 1)
    disk = SqliteDisk(tmp_path)
    async with journal_on(disk) as journal:
        with monkeypatch.context() as full:
            full.setattr(disk, "_connection", FullConnection())
            journal.note(writes.event(1, 1.0, "line.up", "/lines/a", "{1}"))
            journal.note(writes.event(2, 1.0, "line.up", "/lines/a", "{2}"))
            while journal.trouble is None:  # noqa: ASYNC110
                await asyncio.sleep(0.002)
            journal.note(writes.event(3, 1.0, "line.up", "/lines/a", "{3}"))
            await journal.rows("SELECT 1")
        await recovery(journal)
        assert await journal.rows("SELECT number FROM events") == [(1,)]
    assert not was_clean(tmp_path)


class FullConnection:
    """SQLite on a disk without room."""

    def execute(self, sql: str, _: Sequence[Value] = ()) -> Any:
        if sql.startswith("SELECT"):
            return self
        full = sqlite3.OperationalError("database or disk is full")
        full.sqlite_errorcode = sqlite3.SQLITE_FULL
        raise full

    def fetchall(self) -> list[Any]:
        return []


def was_clean(directory: Path) -> bool:
    disk = SqliteDisk(directory)
    rows = disk.rows("SELECT value FROM meta WHERE name = 'clean'")
    disk.close()
    return rows == [("1",)]


async def test_a_disk_that_has_failed_is_not_trusted_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CHECK_S", 0.005)
    disk = ShakyDisk()
    disk.troubles = [DiskFailed("journal.db: disk I/O error")]
    async with journal_on(disk) as journal:
        with pytest.raises(JournalUnavailable, match="I/O error"):
            await journal.write(intent())
        await asyncio.sleep(0.03)
        with pytest.raises(JournalUnavailable, match="I/O error") as known:
            journal.require()
        assert ("restart" in known.value.remedy, "再起動" in known.value.remedy_ja) == (True, True)
    assert disk.commits == []


@pytest.mark.parametrize("file", ["journal.db", "journal.db-wal"])
async def test_a_file_that_has_gone_is_noticed(
    file: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(module, "CHECK_S", 0.01)
    async with journal_on(SqliteDisk(tmp_path)) as journal:
        await journal.write(intent())
        (tmp_path / file).unlink()
        while journal.trouble is None:  # noqa: ASYNC110
            await asyncio.sleep(0.002)
        assert "has gone" in journal.trouble


async def test_a_disk_that_takes_its_time_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "WRITTEN_WITHIN_S", 0.02)
    disk = ShakyDisk()
    disk.may_go_on.clear()
    async with journal_on(disk) as journal:
        with pytest.raises(JournalUnavailable, match="taken nothing"):
            await journal.write(intent())
        disk.may_go_on.set()
        await recovery(journal)


async def test_how_long_gateways_have_run_is_counted_over_their_lives(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = [1000.0]
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(time, "time", lambda: -clock[0])  # which jumps, and is not asked
    for lived_s in (60.0, 90.0):
        journal = open_journal(tmp_path).journal
        clock[0] += lived_s
        journal.writer.look()
        journal.disk.close()
        clock[0] += 4711.0
    after = open_journal(tmp_path).journal
    assert after.writer.ran_s == 150.0
    after.disk.close()
