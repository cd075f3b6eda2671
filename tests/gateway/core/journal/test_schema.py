"""The tables of the journal: a file of any published version is brought to the present one, with its rows."""

import sqlite3
from hashlib import sha256
from pathlib import Path

import pytest

from gateway.core.journal import schema
from gateway.core.journal.disk import SqliteDisk
from gateway.core.journal.opening import begin
from gateway.core.journal.schema import MIGRATIONS, VERSION, migrate
from tests.gateway.core.journal.old_files import file_of

PUBLISHED = (
    "08476699f59f362d",
    "f7671f1cd76cee71",
    "95315515a5981d22",
    "345e7e40ebe582ba",
    "8ca102626f7a58a4",
    "dfdf95b824bd405b",
    "ed5314ab6d458177",
    "d582336975798921",
)


@pytest.mark.parametrize("version", range(1, VERSION + 1))
def test_what_an_earlier_version_has_written_is_known(version: int, tmp_path: Path) -> None:
    file_of(version, tmp_path)
    disk = SqliteDisk(tmp_path)
    past = begin(disk)
    assert (disk.set_aside, past.epoch, past.last_event) == (None, "e1", 7)
    assert (past.moves, past.alarms) == (["{1}"], ["{2}"])
    assert past.begun == {"m1"}
    assert [intent.id for intent in past.open_intents] == ["i1"]
    assert disk.rows("SELECT key FROM keys WHERE ran_s = 0") == [("k",)]
    assert disk.rows("PRAGMA user_version") == [(VERSION,)]
    disk.close()


def test_a_step_that_fails_leaves_the_version_before_it(monkeypatch: pytest.MonkeyPatch) -> None:
    connection = sqlite3.connect(":memory:", isolation_level=None)
    monkeypatch.setattr(schema, "MIGRATIONS", (*MIGRATIONS, "CREATE TABLE more (id); SELECT * FROM nothing"))
    with pytest.raises(sqlite3.OperationalError, match="nothing"):
        migrate(connection)
    connection.rollback()
    assert connection.execute("PRAGMA user_version").fetchone() == (VERSION,)
    assert connection.execute("SELECT name FROM sqlite_master WHERE name = 'more'").fetchall() == []
    connection.close()


def test_no_script_that_was_published_has_changed() -> None:
    assert tuple(sha256(script.encode()).hexdigest()[:16] for script in MIGRATIONS) == PUBLISHED
