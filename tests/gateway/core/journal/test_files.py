"""Journals as files: sound or not, written out, copied and made smaller while a gateway writes them."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from gateway.core.journal import files, writes
from gateway.core.journal.disk import NotWritable, SqliteDisk
from gateway.core.journal.schema import VERSION
from gateway.core.journal.writes import DAY_S, SLICE, Retention
from tests.gateway.core.journal.full_disk import no_room_beyond
from tests.gateway.core.journal.old_files import file_of


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[SqliteDisk]:
    disk = SqliteDisk(tmp_path)
    disk.commit([writes.event(number, 1.0, "t", "s", "{}") for number in range(1, 101)], durable=True)
    moves = [writes.move(f"m{number:03}", 1.0, "a.3F", "{}", final=number != 5) for number in range(20)]
    disk.commit(moves, durable=True)
    yield disk
    disk.close()


def numbers(directory: Path) -> list[int]:
    return [row["number"] for row in files.export(directory) if row["table"] == "events"]


@pytest.mark.usefixtures("disk")
def test_a_sound_journal_has_nothing_to_complain_of(tmp_path: Path) -> None:
    assert files.verify(tmp_path) == []
    with pytest.raises(FileNotFoundError, match="no journal"):
        files.verify(tmp_path / "elsewhere")


def test_missing_events_are_found(disk: SqliteDisk, tmp_path: Path) -> None:
    disk.commit([writes.Write("DELETE FROM events WHERE number = 50", ())], durable=True)
    assert files.verify(tmp_path) == ["1 events between 1 and 100 are missing."]


@pytest.mark.usefixtures("disk")
def test_it_is_written_out_row_by_row(tmp_path: Path) -> None:
    assert numbers(tmp_path) == list(range(1, 101))
    assert sum(row["table"] == "moves" for row in files.export(tmp_path)) == 20


@pytest.mark.usefixtures("disk")
def test_a_copy_is_a_journal_and_nothing_is_overwritten(tmp_path: Path) -> None:
    target = tmp_path / "copy" / "journal.db"
    target.parent.mkdir()
    files.backup(tmp_path, target)
    assert files.verify(target.parent) == []
    assert list(files.export(target.parent)) == list(files.export(tmp_path))
    with pytest.raises(FileExistsError):
        files.backup(tmp_path, target)


def test_what_is_too_much_or_too_old_is_forgotten_and_what_is_open_is_kept(
    disk: SqliteDisk, tmp_path: Path
) -> None:
    disk.commit([writes.meta(writes.RAN_S, str(DAY_S))], durable=True)
    assert files.prune(tmp_path, Retention(events=10, days=1.0)).forgotten == 90 + 19
    assert numbers(tmp_path) == list(range(91, 101))
    assert [row["id"] for row in files.export(tmp_path) if row["table"] == "moves"] == ["m005"]
    assert files.verify(tmp_path) == []


def test_of_a_file_that_is_too_large_the_oldest_intents_that_are_over_are_forgotten(tmp_path: Path) -> None:
    disk = SqliteDisk(tmp_path)
    told = {"target": "a.3F", "command": "home", "effect": "motion", "caller": "test", "frame": "x" * 500}
    ids = [f"i{number:05}" for number in range(2 * SLICE)]
    disk.commit([writes.intent(intent_id, 1.0, **told) for intent_id in ids], durable=True)
    disk.commit([writes.ended(intent_id, 2.0, "answered") for intent_id in ids[1:]], durable=True)
    disk.close()
    assert (tmp_path / "journal.db").stat().st_size > 2 << 20
    assert files.prune(tmp_path, Retention(mebibytes=2)) == (SLICE, True)
    kept = [row["id"] for row in files.export(tmp_path) if row["table"] == "intents"]
    assert kept == [ids[0], *ids[SLICE + 1 :]]
    assert (tmp_path / "journal.db").stat().st_size < 2 << 20


def test_of_a_file_that_is_too_large_answers_and_stops_pay_before_other_deeds(tmp_path: Path) -> None:
    disk = SqliteDisk(tmp_path)
    told = {"target": "a.3F", "command": "home", "caller": "test", "frame": "x" * 500}
    deeds = {f"i{number:04}": ("motion", "stop")[number % 2] for number in range(1000)}
    disk.commit([writes.intent(it, 1.0, effect=effect, **told) for it, effect in deeds.items()], durable=True)
    disk.commit([writes.ended(it, 2.0, "answered") for it in deeds], durable=True)
    keys = [f"k{number}" for number in range(1000)]
    disk.commit([writes.key_used("v POST /x", key, "d", 1.0) for key in keys], durable=True)
    disk.commit([writes.key_answered("v POST /x", key, 200, None, "x" * 4000) for key in keys], durable=True)
    disk.commit([writes.meta(writes.RAN_S, str(writes.REPEATED_S))], durable=True)
    disk.close()

    def left() -> tuple[int, list[str]]:
        rows = list(files.export(tmp_path))
        effects = [row["effect"] for row in rows if row["table"] == "intents"]
        return sum(row["table"] == "keys" for row in rows), effects

    files.prune(tmp_path, Retention(mebibytes=2))
    assert left() == (0, [*deeds.values()])
    disk = SqliteDisk(tmp_path)
    disk.commit([writes.move("m1", 1.0, "a.3F", "x" * (1 << 20), final=True)], durable=True)
    disk.close()
    files.prune(tmp_path, Retention(mebibytes=1))
    keys_left, effects = left()
    assert (keys_left, effects.count("stop")) == (0, 0)
    assert files.verify(tmp_path) == []


def test_of_one_caller_the_newest_answers_are_kept(tmp_path: Path) -> None:
    disk = SqliteDisk(tmp_path)
    for caller, number in (("viewer", 9), ("view", 5), ("viewers", 5)):
        keys = [f"k{it}" for it in range(number)]
        scope = f"{caller} POST /x"
        disk.commit(
            [writes.key_used(scope, key, "d", float(at)) for at, key in enumerate(keys)], durable=True
        )
        disk.commit([writes.key_answered(scope, key, 200, None, "{}") for key in keys[1:]], durable=True)
    disk.commit([writes.keys_beyond("viewer", 3)], durable=True)
    disk.close()
    rows = [row for row in files.export(tmp_path) if row["table"] == "keys"]
    kept = {
        name: {row["key"] for row in rows if row["scope"] == f"{name} POST /x"} for name in ("viewer", "view")
    }
    assert kept["viewer"] == {"k0", "k6", "k7", "k8"}  # the first is still under way
    assert len(kept["view"]) == 5
    assert len(rows) == 4 + 5 + 5


def test_what_a_wall_clock_has_dated_a_year_early_or_late_is_kept(tmp_path: Path) -> None:
    disk, year_s = SqliteDisk(tmp_path), 365 * DAY_S
    disk.commit([writes.meta(writes.RAN_S, str(100 * DAY_S))], durable=True)
    dates = {"early": -year_s, "late": year_s}
    disk.commit([writes.move(name, at, "a.3F", "{}", final=True) for name, at in dates.items()], durable=True)
    disk.commit([writes.key_used("s", name, "d", at) for name, at in dates.items()], durable=True)
    disk.commit([writes.key_answered("s", name, 202, None, "{}") for name in dates], durable=True)
    disk.commit([writes.meta(writes.RAN_S, str(100.5 * DAY_S))], durable=True)
    disk.close()
    assert files.prune(tmp_path, Retention()).forgotten == 0
    assert files.prune(tmp_path, Retention(days=0.5, keys_days=0.5)).forgotten == 4


def test_a_broken_file_is_called_broken(tmp_path: Path) -> None:
    (tmp_path / "journal.db").write_bytes(b"x" * 10_000)
    [complaint] = files.verify(tmp_path)
    assert "not a database" in complaint
    with pytest.raises(sqlite3.DatabaseError):
        list(files.export(tmp_path))


@pytest.mark.parametrize("version", range(1, VERSION))
def test_a_journal_of_an_earlier_version_is_sound_and_written_out_whole(version: int, tmp_path: Path) -> None:
    file_of(version, tmp_path)
    assert (files.verify(tmp_path), files.version_of(tmp_path)) == ([], version)
    tables = [row["table"] for row in files.export(tmp_path)]
    assert tables == ["meta", "meta", "intents", "moves", "events", "keys", "alarms"]


def test_a_journal_of_a_later_version_is_told_and_written_out_with_its_new_tables(tmp_path: Path) -> None:
    later_than_this(tmp_path)
    [complaint] = files.verify(tmp_path)
    assert "a later gateway has written" in complaint
    assert {"table": "news", "id": "n1"} in files.export(tmp_path)


def test_tables_of_another_version_are_not_pruned(tmp_path: Path) -> None:
    file_of(VERSION - 1, tmp_path)
    with pytest.raises(files.OtherVersion, match="Start this gateway on it once"):
        files.prune(tmp_path, Retention(events=0))
    later_than_this(tmp_path)
    with pytest.raises(files.OtherVersion, match="Use the later motion-gateway"):
        files.prune(tmp_path, Retention(events=0))
    assert numbers(tmp_path) == [7]


def later_than_this(directory: Path) -> None:
    """Make a journal one that this gateway does not know yet."""
    SqliteDisk(directory).close()
    with closing(sqlite3.connect(directory / "journal.db", isolation_level=None)) as later:
        later.executescript("CREATE TABLE news (id TEXT); INSERT INTO news VALUES ('n1')")
        later.execute(f"PRAGMA user_version = {VERSION + 1}")


def test_while_a_gateway_runs_the_file_keeps_its_size_and_nothing_holds_it(tmp_path: Path) -> None:
    disk = SqliteDisk(tmp_path)
    disk.commit([writes.event(number, 1.0, "t", "s", "{}") for number in (1, 2, 3)], durable=True)
    assert files.prune(tmp_path, Retention(events=1)) == (2, False)
    disk.close()
    assert files.prune(tmp_path, Retention(events=1)) == (0, True)


def test_a_full_disk_is_no_damage(tmp_path: Path) -> None:
    file_of(VERSION, tmp_path)
    SqliteDisk(tmp_path).close()
    with no_room_beyond(0):
        assert files.verify(tmp_path) == []
        assert numbers(tmp_path) == [7]


def test_a_copy_that_finds_no_room_is_taken_away(disk: SqliteDisk, tmp_path: Path) -> None:
    disk.commit([writes.event(101, 1.0, "t", "s", "x" * 200_000)], durable=True)
    with no_room_beyond(40_000), pytest.raises(NotWritable, match=r"copy\.db: No space left on device"):
        files.backup(tmp_path, tmp_path / "copy.db")
    assert list(tmp_path.glob("copy*")) == []
