"""The journal's file: SQLite in WAL mode, opened by one gateway at a time."""

import errno
import fcntl
import os
import sqlite3
import time
from collections.abc import Sequence
from contextlib import closing, suppress
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Any, Protocol

from gateway.core.journal.schema import migrate
from gateway.core.journal.writes import Value, Write

FILE = "journal.db"
LOCK = "journal.lock"
WAL_BYTES = 8 << 20
"""A write-ahead log this long is folded into the file at the next quiet moment."""


class DiskFull(OSError):
    """There is no room; what was to be written was not, and can be later."""


class DiskFailed(OSError):
    """The file cannot be trusted any more in this process."""


class InUse(OSError):
    """Another gateway has this directory."""


class Disk(Protocol):
    """Where a journal is kept. All methods but `close` and `read_apart` are called from one thread."""

    def commit(self, writes: Sequence[Write], *, durable: bool) -> None:
        """Write all or nothing; `durable` when the power may be cut after this returns.

        :raises DiskFull: nothing of it was written; a later one may succeed.
        :raises DiskFailed: nobody knows what was written, and nothing more will be.
        """

    def rows(self, sql: str, values: Sequence[Value] = ()) -> list[tuple[Any, ...]]:
        """Read rows."""

    def read_apart(self, sql: str, values: Sequence[Value] = ()) -> list[tuple[Any, ...]]:
        """Read rows beside the writer, from any thread: that may take long."""

    def check(self) -> None:
        """See that the file is still there.

        :raises DiskFailed: it is not.
        """

    def tidy(self) -> None:
        """Do what can wait for a quiet moment."""

    def close(self) -> None:
        """Release the file."""


class SqliteDisk:
    """A directory with the file and its lock."""

    def __init__(self, directory: Path) -> None:
        """Open the journal of a directory, or make one.

        A file that is no sound journal is set aside, and a new one is begun: see `set_aside`.

        :raises InUse: another gateway has it open.
        :raises TooNew: a later version of the gateway has written it.
        :raises DiskFull, DiskFailed: the directory cannot be written.
        """
        self.path = directory / FILE
        self.set_aside: Path | None = None
        """Where a broken file was put when this was opened."""
        try:
            directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._lock = os.open(directory / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError as error:
            raise _fault(error, directory) from None
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._lock)
            raise InUse(f"another gateway uses {directory}") from None
        try:
            self._connection = self._open_or_begin_anew()
            self._inode = self.path.stat().st_ino
        except BaseException:
            os.close(self._lock)
            raise
        self._synchronous = ""

    def _open_or_begin_anew(self) -> sqlite3.Connection:
        try:
            return _open(self.path)
        except sqlite3.DatabaseError as error:
            if isinstance(error, sqlite3.OperationalError):
                raise _fault(error, self.path) from None
        self.set_aside = self.path.with_name(f"journal.broken-{time.time_ns():d}.db")
        self.path.rename(self.set_aside)
        for rest in ("-wal", "-shm"):
            with suppress(FileNotFoundError):
                Path(f"{self.path}{rest}").rename(f"{self.set_aside}{rest}")
        return _open(self.path)

    def commit(self, writes: Sequence[Write], *, durable: bool) -> None:
        """Write all or nothing."""
        connection = self._connection
        try:
            self._synchronise("FULL" if durable else "NORMAL")
            connection.execute("BEGIN IMMEDIATE")
            for sql, alike in groupby(writes, itemgetter(0)):
                connection.executemany(sql, map(itemgetter(1), alike))
            connection.execute("COMMIT")
        except sqlite3.Error as error:
            with suppress(sqlite3.Error):
                connection.execute("ROLLBACK")
            raise _fault(error, self.path) from None

    def _synchronise(self, how: str) -> None:
        if how != self._synchronous:
            self._connection.execute(f"PRAGMA synchronous = {how}")
            self._synchronous = how

    def rows(self, sql: str, values: Sequence[Value] = ()) -> list[tuple[Any, ...]]:
        """Read rows."""
        return self._connection.execute(sql, values).fetchall()

    def read_apart(self, sql: str, values: Sequence[Value] = ()) -> list[tuple[Any, ...]]:
        """Read rows by a connection of their own, which waits for no writer and keeps none waiting."""
        uri = f"{self.path.absolute().as_uri()}?mode=ro"
        with closing(sqlite3.connect(uri, uri=True, timeout=1.0)) as connection:
            return connection.execute(sql, values).fetchall()

    def check(self) -> None:
        """See that the file is still the one that was opened."""
        try:
            inode = self.path.stat().st_ino
        except OSError as error:
            raise DiskFailed(f"{self.path} has gone: {error.strerror}") from None
        if inode != self._inode:
            raise DiskFailed(f"{self.path} was replaced by another file")

    def tidy(self) -> None:
        """Fold a long write-ahead log into the file."""
        with suppress(FileNotFoundError):
            if Path(f"{self.path}-wal").stat().st_size > WAL_BYTES:
                self._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")

    def close(self) -> None:
        """Release the file and its lock."""
        self._connection.close()
        os.close(self._lock)


def _open(path: Path) -> sqlite3.Connection:
    """Open a sound file, and bring its tables to the present version.

    :raises sqlite3.DatabaseError: it is not sound.
    """
    connection = sqlite3.connect(path, isolation_level=None, check_same_thread=False, timeout=1.0)
    try:
        path.chmod(0o600)
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA wal_autocheckpoint = 0")  # done in quiet moments: it takes milliseconds
        _require_sound(connection)
        migrate(connection)
    except BaseException:
        connection.close()
        raise
    return connection


def _require_sound(connection: sqlite3.Connection) -> None:
    """Look over the structure of a file, not over each index: that takes long."""
    (found,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    if found != "ok":
        raise sqlite3.DatabaseError(found)


def _fault(error: Exception, where: Path) -> OSError:
    if isinstance(error, OSError):
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        return (DiskFull if full else DiskFailed)(f"{where}: {error.strerror}")
    full = getattr(error, "sqlite_errorcode", 0) == sqlite3.SQLITE_FULL
    return (DiskFull if full else DiskFailed)(f"{where}: {error}")
