"""Journals as files: looked over, written out, copied, made smaller. A gateway may be writing them."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any, Final

from gateway.core.journal.disk import FILE
from gateway.core.journal.retention import Retention, forget
from gateway.core.journal.schema import VERSION
from gateway.core.journal.writes import RAN_S

TABLES: Final = ("meta", "intents", "moves", "events", "keys", "alarms", "works")


def verify(directory: Path) -> list[str]:
    """Say what is wrong with a journal; nothing where it is sound.

    :raises FileNotFoundError: there is none.
    """
    with closing(_reader(directory)) as connection:
        try:
            return [*_structure(connection), *_sense(connection)]
        except sqlite3.DatabaseError as error:
            return [f"The file is damaged: {error}."]


def export(directory: Path) -> Iterator[dict[str, Any]]:
    """Every row of a journal, with its `table`, as it is at one moment.

    :raises FileNotFoundError: there is none.
    """
    with closing(_reader(directory)) as connection:
        connection.execute("BEGIN")
        for table in TABLES:
            cursor = connection.execute(f"SELECT * FROM {table}")  # noqa: S608  # our own names
            columns = [column[0] for column in cursor.description]
            for row in cursor:
                yield {"table": table, **dict(zip(columns, row, strict=True))}


def backup(directory: Path, target: Path) -> None:
    """Copy a journal, as it is at one moment, into a file that does not exist yet.

    :raises FileNotFoundError: there is none.
    :raises FileExistsError: the file exists; it was not touched.
    """
    with closing(_reader(directory)) as source:
        if not target.absolute().parent.is_dir():
            raise FileNotFoundError(f"There is no directory {target.parent}; nothing was written.")
        target.touch(mode=0o600, exist_ok=False)
        with closing(sqlite3.connect(target)) as copy:
            source.backup(copy)


def prune(directory: Path, kept: Retention) -> int:
    """Forget what is too old or too much, give the room back, and say how many rows were forgotten.

    :raises FileNotFoundError: there is none.
    """
    path = _path(directory)
    forgotten = 0
    with closing(sqlite3.connect(path, isolation_level=None, timeout=10.0)) as connection:
        while (rows := _forget_once(connection, kept)) > 0:
            forgotten += rows
        connection.execute("VACUUM")
    return forgotten


def _forget_once(connection: sqlite3.Connection, kept: Retention) -> int:
    connection.execute("BEGIN IMMEDIATE")
    (ran_s,) = connection.execute("SELECT max(value) FROM meta WHERE name = ?", (RAN_S,)).fetchone()
    rows = sum(connection.execute(it.sql, it.values).rowcount for it in forget(float(ran_s or 0.0), kept))
    connection.execute("COMMIT")
    return rows


def _path(directory: Path) -> Path:
    path = directory / FILE
    if not path.is_file():
        raise FileNotFoundError(f"There is no journal in {directory}.")
    return path


def _reader(directory: Path) -> sqlite3.Connection:
    return sqlite3.connect(f"{_path(directory).absolute().as_uri()}?mode=ro", uri=True, timeout=10.0)


def _structure(connection: sqlite3.Connection) -> Iterator[str]:
    for (text,) in connection.execute("PRAGMA integrity_check"):
        if text != "ok":
            yield text
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if version != VERSION:
        yield f"It has version {version} of the tables; this gateway writes {VERSION}."


def _sense(connection: sqlite3.Connection) -> Iterator[str]:
    """What the entries say of each other."""
    numbers = "SELECT min(number), max(number), count(*) FROM events"
    first, last, count = connection.execute(numbers).fetchone()
    if count and last - first + 1 != count:
        yield f"{last - first + 1 - count} events between {first} and {last} are missing."
    silent = "SELECT count(*) FROM intents WHERE ended_at IS NOT NULL AND outcome IS NULL"
    (unknown,) = connection.execute(silent).fetchone()
    if unknown:
        yield f"{unknown} intents have ended without an outcome."
