"""The file of the journal: one owner, sound or set aside, all or nothing."""

import os
import resource
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from gateway.core.journal import schema, writes
from gateway.core.journal.disk import DiskFailed, InUse, NotWritable, SqliteDisk, fault
from gateway.core.journal.opening import OpenIntent, begin
from gateway.core.journal.schema import TooNew
from tests.gateway.core.journal.full_disk import no_room_beyond

TOLD = {"command": "home", "effect": "motion", "frame": "&3FHMF\\r", "caller": "test"}


def test_two_gateways_never_share_a_directory(tmp_path: Path) -> None:
    disk = SqliteDisk(tmp_path)
    with pytest.raises(InUse, match="another gateway"):
        SqliteDisk(tmp_path)
    disk.close()
    SqliteDisk(tmp_path).close()


def test_nobody_else_may_read_it(tmp_path: Path) -> None:
    SqliteDisk(tmp_path / "data").close()
    assert (tmp_path / "data").stat().st_mode & 0o777 == 0o700
    assert (tmp_path / "data" / "journal.db").stat().st_mode & 0o777 == 0o600


def test_a_file_that_is_no_journal_is_set_aside(tmp_path: Path) -> None:
    content = b"not a database at all, but long enough to be read as one" * 99
    (tmp_path / "journal.db").write_bytes(content)
    disk = SqliteDisk(tmp_path)
    disk.commit([writes.meta("a", "b")], durable=True)
    assert disk.set_aside is not None
    assert disk.set_aside.read_bytes() == content
    disk.close()


def test_a_damaged_page_is_found_and_the_file_set_aside(tmp_path: Path) -> None:
    disk = SqliteDisk(tmp_path)
    disk.commit(events(1, 500), durable=True)
    epoch = begin(disk).epoch
    disk.close()
    damaged = bytearray((tmp_path / "journal.db").read_bytes())
    damaged[20_480:102_400] = bytes(102_400 - 20_480)
    (tmp_path / "journal.db").write_bytes(damaged)
    disk = SqliteDisk(tmp_path)
    assert disk.set_aside is not None
    assert begin(disk).epoch != epoch
    disk.close()


def test_a_commit_is_all_or_nothing(tmp_path: Path) -> None:
    disk = SqliteDisk(tmp_path)
    with pytest.raises(DiskFailed):
        disk.commit([writes.meta("a", "1"), writes.Write("INSERT INTO nothing VALUES (1)", ())], durable=True)
    assert disk.rows("SELECT * FROM meta") == []
    disk.close()


def test_a_journal_of_a_later_version_is_left_alone(tmp_path: Path) -> None:
    SqliteDisk(tmp_path).close()
    with closing(sqlite3.connect(tmp_path / "journal.db")) as connection:
        connection.execute(f"PRAGMA user_version = {schema.VERSION + 1}")
    with pytest.raises(TooNew, match="this gateway knows"):
        SqliteDisk(tmp_path)


def test_a_directory_that_cannot_be_written_says_so(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(DiskFailed, match="file"):
        SqliteDisk(tmp_path / "file")


def test_the_next_life_knows_how_the_last_one_ended(tmp_path: Path) -> None:
    disk = SqliteDisk(tmp_path)
    first = begin(disk)
    assert (first.was_clean, first.seen_at, first.last_event, first.moves) == (True, None, 0, [])
    disk.commit(
        [
            writes.event(4, 1.0, "line.up", "/lines/a", "{4}"),
            writes.event(6, 1.0, "line.up", "/lines/a", "{6}"),
            writes.event(7, 1.0, "line.down", "/lines/a", "{7}"),
            writes.intent("i1", 1.0, target="a.3F", **TOLD, move_id="m1 m2"),
            writes.written("i1", 1.0),
            writes.intent("i0", 1.0, target="a.3F", **TOLD),
            writes.ended("i0", 1.0, "answered"),
            writes.move("m1", 1.0, "a.3F", "{1}", final=False),
            writes.move("m0", 1.0, "a.3F", "{0}", final=True),
        ],
        durable=True,
    )
    disk.close()
    disk = SqliteDisk(tmp_path)
    second = begin(disk)
    assert (second.last_event, second.was_clean, second.seen_at is not None) == (7, False, True)
    assert second.moves == ["{0}", "{1}"]
    assert second.events == [("line.up", "/lines/a", "{6}"), ("line.down", "/lines/a", "{7}")]
    assert second.open_intents == [OpenIntent("i1", "a.3F", "home", written=True, moves=["m1", "m2"])]
    assert second.begun == {"m1"}
    assert second.earlier == {first.epoch: 7}
    assert second.epoch != first.epoch
    disk.commit([writes.meta("clean", "1")], durable=True)
    third = begin(disk)
    assert third.was_clean
    assert (third.epoch, third.earlier) == (second.epoch, second.earlier)
    disk.close()


def test_a_long_write_ahead_log_is_folded_and_then_written_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gateway.core.journal.disk.WAL_BYTES", limit := 100_000)
    disk, log = SqliteDisk(tmp_path), tmp_path / "journal.db-wal"
    disk.commit(events(1, 500), durable=True)
    assert log.stat().st_size > limit
    disk.tidy()
    for number in range(500, 510):
        disk.commit(events(number, number + 1), durable=True)
        assert log.stat().st_size == limit
    assert disk.read_apart("SELECT count(*) FROM events") == [(509,)]
    disk.close()


def test_where_there_is_no_room_to_fold_the_log_nothing_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gateway.core.journal.disk.WAL_BYTES", 100_000)
    disk = SqliteDisk(tmp_path)
    disk.commit(events(1, 500), durable=True)
    with (
        no_room_beyond((tmp_path / "journal.db").stat().st_size),
        pytest.raises(NotWritable, match="No space left"),
    ):
        disk.tidy()
    assert disk.rows("SELECT count(*) FROM events") == [(499,)]
    disk.tidy()
    disk.close()


def test_room_that_is_made_between_a_write_and_the_look_for_its_obstacle_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = SqliteDisk(tmp_path)
    with no_room_beyond((tmp_path / "journal.db").stat().st_size) as soft_and_hard:

        def room_now(_: Path) -> None:
            resource.setrlimit(resource.RLIMIT_FSIZE, soft_and_hard)

        monkeypatch.setattr("gateway.core.journal.disk._obstacle", room_now)
        disk.commit(events(1, 500), durable=True)
    assert disk.rows("SELECT count(*) FROM events") == [(499,)]
    disk.close()


def test_a_file_of_another_user_is_told_as_such_and_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As after a command that was run as root: SQLite says no more than that there was an error."""
    SqliteDisk(tmp_path).close()
    monkeypatch.setattr(os, "access", lambda *_: False)  # to root all is allowed
    found = fault(sqlite3.OperationalError("disk I/O error"), tmp_path / "journal.db")
    assert (type(found), str(found)) == (NotWritable, f"{tmp_path / 'journal.db'}: Permission denied")


def test_a_disk_that_refuses_twice_without_a_reason_is_not_trusted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gateway.core.journal.disk._obstacle", lambda _: None)
    disk = SqliteDisk(tmp_path)
    with (
        no_room_beyond((tmp_path / "journal.db").stat().st_size),
        pytest.raises(DiskFailed, match="disk I/O error"),
    ):
        disk.commit(events(1, 500), durable=True)
    assert disk.rows("SELECT count(*) FROM events") == [(0,)]
    disk.close()


def events(first: int, end: int) -> list[writes.Write]:
    return [writes.event(number, 1.0, "t", "s", "x" * 500) for number in range(first, end)]
