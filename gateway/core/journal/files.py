"""Journals as files: looked over, written out, copied, made smaller. A gateway may be writing them."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from gateway.core.journal.disk import FILE, fault, is_damage, is_in_use, open_as_it_is
from gateway.core.journal.schema import VERSION, written_version
from gateway.core.journal.writes import RAN_S, Retention, forget


class OtherVersion(Exception):
    """The tables are those of an earlier or a later gateway; nothing was changed."""


class Pruned(NamedTuple):
    """The result of making a journal smaller."""

    forgotten: int
    """Entries."""
    is_smaller: bool
    """True if their room was given back to the disk.

    While a gateway runs it stays in the file, to be used again: while SQLite gives it back, the gateway would
    refuse moves.
    """


def verify(directory: Path) -> list[str]:
    """Say what is wrong with a journal; nothing where it is sound, be it of an earlier version.

    :raises FileNotFoundError: there is none.
    :raises NotWritable, DiskFailed: something else keeps it from being read.
    """
    try:
        with _reader(directory) as connection:
            return [*_structure(connection), *_sense(connection)]
    except sqlite3.DatabaseError as error:
        return [f"The file is damaged: {error}."]


def version_of(directory: Path) -> int:
    """Version of the tables of a sound journal."""
    with _reader(directory) as connection:
        return written_version(connection)


def export(directory: Path) -> Iterator[dict[str, Any]]:
    """Every row of a journal of any version, with its `table`, as it is at one moment.

    :raises FileNotFoundError: there is none.
    :raises NotWritable, DiskFailed: it cannot be read.
    """
    with _reader(directory) as connection:
        connection.execute("BEGIN")
        tables = connection.execute("SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY rowid")
        for (table,) in tables.fetchall():
            cursor = connection.execute(f"SELECT * FROM {table}")  # noqa: S608  # our own names
            columns = [column[0] for column in cursor.description]
            for row in cursor:
                yield {"table": table, **dict(zip(columns, row, strict=True))}


def backup(directory: Path, target: Path) -> None:
    """Copy a journal, as it is at one moment, into a file that does not exist yet, wholly or not at all.

    :raises FileNotFoundError: there is none.
    :raises FileExistsError: the file exists; it was not touched.
    :raises NotWritable, DiskFailed: it cannot be read or written.
    """
    with _reader(directory) as source:
        if not target.absolute().parent.is_dir():
            raise FileNotFoundError(f"There is no directory {target.parent}; nothing was written.")
        target.touch(mode=0o600, exist_ok=False)
        try:
            with _explained(target), closing(sqlite3.connect(target)) as copy:
                source.backup(copy)
        except BaseException:
            for rest in ("", "-journal"):
                Path(f"{target}{rest}").unlink(missing_ok=True)
            raise


def prune(directory: Path, kept: Retention) -> Pruned:
    """Forget what is too old or too much, and give the room back unless a gateway runs.

    :raises FileNotFoundError: there is none.
    :raises OtherVersion: its tables are those of another version; nothing was forgotten.
    :raises NotWritable, DiskFailed: it cannot be written.
    """
    path = _path(directory)
    forgotten = 0
    with _explained(path), closing(sqlite3.connect(path, isolation_level=None, timeout=10.0)) as connection:
        _require_present_tables(connection)
        while (rows := _forget_once(connection, kept)) > 0:
            forgotten += rows
        if is_in_use(directory):
            return Pruned(forgotten, is_smaller=False)
        connection.execute("VACUUM")
    return Pruned(forgotten, is_smaller=True)


def _require_present_tables(connection: sqlite3.Connection) -> None:
    version = written_version(connection)
    if version == VERSION:
        return
    whose, what_to_do = (
        ("an earlier gateway", "Start this gateway on it once: that brings it up to date.")
        if version < VERSION
        else ("a later gateway", "Use the later motion-gateway.")
    )
    raise OtherVersion(
        f"The journal has version {version} of the tables, which {whose} has written, and this one writes "
        f"{VERSION}; nothing was forgotten. {what_to_do}"
    )


def _forget_once(connection: sqlite3.Connection, kept: Retention) -> int:
    connection.execute("BEGIN IMMEDIATE")
    (ran_s,) = connection.execute("SELECT max(value) FROM meta WHERE name = ?", (RAN_S,)).fetchone()
    rows = sum(
        connection.execute(statement.sql, statement.values).rowcount
        for statement in forget(float(ran_s or 0.0), kept)
    )
    connection.execute("COMMIT")
    return rows


def _path(directory: Path) -> Path:
    path = directory / FILE
    if not path.is_file():
        raise FileNotFoundError(f"There is no journal in {directory}.")
    return path


@contextmanager
def _reader(directory: Path) -> Iterator[sqlite3.Connection]:
    """Open a journal to be read, where nothing can be written, too."""
    path = _path(directory)
    with _explained(path), closing(_open(path)) as connection:
        yield connection


def _open(path: Path) -> sqlite3.Connection:
    connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=10.0)
    try:
        written_version(connection)
    except sqlite3.Error as error:
        connection.close()
        if is_damage(error):
            raise
        return open_as_it_is(path)  # there is no room for the file beside the write-ahead log
    return connection


@contextmanager
def _explained(path: Path) -> Iterator[None]:
    """Tell damage from a disk that is full, and from whatever else is in the way."""
    try:
        yield
    except sqlite3.Error as error:
        if is_damage(error):
            raise
        raise fault(error, path) from None


def _structure(connection: sqlite3.Connection) -> Iterator[str]:
    for (text,) in connection.execute("PRAGMA integrity_check"):
        if text != "ok":
            yield text
    if (version := written_version(connection)) > VERSION:
        yield (
            f"It has version {version} of the tables, which a later gateway has written; this one knows "
            f"{VERSION} and does not start on it."
        )


def _sense(connection: sqlite3.Connection) -> Iterator[str]:
    """Contradictions between the entries, in words."""
    numbers = "SELECT min(number), max(number), count(*) FROM events"
    first, last, count = connection.execute(numbers).fetchone()
    if count and last - first + 1 != count:
        yield f"{last - first + 1 - count} events between {first} and {last} are missing."
    silent = "SELECT count(*) FROM intents WHERE ended_at IS NOT NULL AND outcome IS NULL"
    (unknown,) = connection.execute(silent).fetchone()
    if unknown:
        yield f"{unknown} intents have ended without an outcome."
