"""The journal's file: SQLite in WAL mode, opened by one gateway at a time."""

import errno
import fcntl
import os
import sqlite3
import time
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from functools import partial
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, Protocol, TypeVar

from gateway.core.journal.schema import VERSION, TooNew, migrate, version_of
from gateway.core.journal.writes import Value, Write

_Gives = TypeVar("_Gives")

FILE = "journal.db"
LOCK = "journal.lock"
WAL_BYTES = 8 << 20
"""A write-ahead log longer than this is folded into the file at the next quiet moment, and written over: to
lengthen a file costs a synchronised write a fifth more."""

_NO_ROOM = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
_READ_ONLY = frozenset({errno.EROFS, errno.EACCES, errno.EPERM})
_SQLITE_FULL = frozenset({sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR_SHMSIZE})
"""The second where there is no room for the file beside the write-ahead log: nothing was written yet."""
_SQLITE_LOST = frozenset({sqlite3.SQLITE_IOERR_FSYNC, sqlite3.SQLITE_IOERR_DIR_FSYNC})
"""Errors of SQLite after which it is unknown what was written."""
LOCKED_S = 1.0
"""Seconds for which another program, such as `journal prune`, may hold the file before that is trouble."""
_PROBE_BYTES = 64 << 10
"""More than SQLite needs at once."""


class NotWritable(OSError):
    """The disk is full or read-only, or another program holds the file; that may change later."""


class DiskFailed(OSError):
    """The file cannot be trusted any more in this process."""


class _Unexplained(DiskFailed):
    """Nothing was written, and nothing is in the way now: what was may have gone since."""


class InUse(DiskFailed):
    """Another gateway uses this directory."""


class Disk(Protocol):
    """Where a journal is kept. All methods but `close` and `read_apart` are called from one thread."""

    def commit(self, writes: Sequence[Write], *, durable: bool) -> None:
        """Write all or nothing; `durable` when the power may be cut after this returns.

        :raises NotWritable: nothing of it was written; a later one may succeed.
        :raises DiskFailed: it is unknown what was written, and nothing more will be.
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
        """Do what can wait for a quiet moment.

        :raises NotWritable: there is no room for it; nothing is lost.
        :raises DiskFailed: the file is not sound.
        """

    def close(self) -> None:
        """Release the file."""


class SqliteDisk:
    """A directory with the file and its lock. Where they cannot be written, commits go on trying."""

    def __init__(self, directory: Path) -> None:
        """Open the journal of a directory, or make one.

        A file that is no sound journal is set aside, and a new one is begun: see `set_aside`.

        :raises InUse: another gateway has it open.
        :raises TooNew: a later version of the gateway has written it.
        :raises DiskFailed: the directory cannot be used.
        """
        self.path = directory / FILE
        self.set_aside: Path | None = None
        """File to which a broken journal was moved when this was opened."""
        self._lock: int | None = None
        self._connection: sqlite3.Connection | None = None
        self._inodes: dict[Path, int] = {}
        self._synchronous = ""
        try:
            self._make_ready_or_wait()
        except BaseException:
            self.close()
            raise

    def _make_ready_or_wait(self) -> None:
        """Be content with a file that can be read, if its tables need not be brought to this version."""
        try:
            self._make_ready(self._open_or_begin_anew)
        except NotWritable as why:
            with closing(open_as_it_is(self.path)) as connection:
                version = version_of(connection)
            if version < VERSION:
                told = f"{why}; so its tables, of version {version}, cannot be brought to version {VERSION}"
                raise DiskFailed(told) from None

    def _make_ready(self, open_: Callable[[Path], sqlite3.Connection]) -> sqlite3.Connection:
        """Do what could not be done yet.

        :raises NotWritable: it still cannot.
        """
        if self._lock is None:
            self._lock = _lock(self.path.parent)
        if self._connection is None:
            self._connection = _twice(partial(self._open_with, open_))
            self._inodes = {file: file.stat().st_ino for file in (self.path, Path(f"{self.path}-wal"))}
        return self._connection

    def _open_with(self, open_: Callable[[Path], sqlite3.Connection]) -> sqlite3.Connection:
        try:
            return open_(self.path)
        except (OSError, sqlite3.Error) as error:
            raise fault(error, self.path) from None

    def _make_ready_late(self) -> sqlite3.Connection:
        """Do the same after the past was read: the file has to be sound."""
        try:
            return self._make_ready(_open)
        except TooNew as error:
            raise DiskFailed(f"{self.path}: {error}") from None

    def _open_or_begin_anew(self, path: Path) -> sqlite3.Connection:
        try:
            return _open(path)
        except sqlite3.OperationalError:
            raise
        except sqlite3.DatabaseError:
            self._set_aside()
        return _open(path)

    def begin_anew(self) -> None:
        """Set aside a file that is sound and makes no sense, and begin another."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None
        self._set_aside()
        with suppress(NotWritable):
            self._make_ready(_open)

    def _set_aside(self) -> None:
        self.set_aside = self.path.with_name(f"journal.broken-{time.time_ns():d}.db")
        self.path.rename(self.set_aside)
        for rest in ("-wal", "-shm"):
            with suppress(FileNotFoundError):
                Path(f"{self.path}{rest}").rename(f"{self.set_aside}{rest}")

    def commit(self, writes: Sequence[Write], *, durable: bool) -> None:
        """Write all or nothing."""
        connection = self._connection or self._make_ready_late()
        _twice(partial(self._commit, connection, writes, durable=durable))

    def _commit(self, connection: sqlite3.Connection, writes: Sequence[Write], *, durable: bool) -> None:
        try:
            self._synchronise(connection, "FULL" if durable else "NORMAL")
            connection.execute("BEGIN IMMEDIATE")
            for sql, alike in groupby(writes, itemgetter(0)):
                connection.executemany(sql, map(itemgetter(1), alike))
            connection.execute("COMMIT")
        except sqlite3.Error as error:
            with suppress(sqlite3.Error):
                connection.execute("ROLLBACK")
            raise fault(error, self.path) from None

    def _synchronise(self, connection: sqlite3.Connection, how: str) -> None:
        if how != self._synchronous:
            connection.execute(f"PRAGMA synchronous = {how}")
            self._synchronous = how

    def rows(self, sql: str, values: Sequence[Value] = ()) -> list[tuple[Any, ...]]:
        """Read rows."""
        if self._connection is not None:
            return self._connection.execute(sql, values).fetchall()
        with closing(open_as_it_is(self.path)) as connection:
            return connection.execute(sql, values).fetchall()

    def read_apart(self, sql: str, values: Sequence[Value] = ()) -> list[tuple[Any, ...]]:
        """Read rows by a connection of their own, which waits for no writer and keeps none waiting."""
        if self._connection is None:
            return self.rows(sql, values)
        uri = f"{self.path.absolute().as_uri()}?mode=ro"
        with closing(sqlite3.connect(uri, uri=True, timeout=1.0)) as connection:
            return connection.execute(sql, values).fetchall()

    def check(self) -> None:
        """See that the file and its write-ahead log are still those that were opened."""
        for file, known in self._inodes.items():
            try:
                inode = file.stat().st_ino
            except OSError as error:
                raise DiskFailed(f"{file} has gone: {error.strerror}") from None
            if inode != known:
                raise DiskFailed(f"{file} was replaced by another file")

    def tidy(self) -> None:
        """Fold a long write-ahead log into the file."""
        _twice(self._fold)

    def _fold(self) -> None:
        try:
            if Path(f"{self.path}-wal").stat().st_size > WAL_BYTES:
                self.rows("PRAGMA wal_checkpoint(RESTART)")
        except FileNotFoundError:
            return
        except sqlite3.Error as error:
            raise fault(error, self.path) from None

    def close(self) -> None:
        """Release the file and its lock."""
        if self._connection is not None:
            self._connection.close()
        if self._lock is not None:
            os.close(self._lock)


def _lock(directory: Path) -> int:
    """Make the directory, if there is none, and lock it; gives the file that holds the lock.

    :raises InUse: another gateway has it.
    :raises NotWritable, DiskFailed: it cannot be written.
    """
    try:
        directory.mkdir(mode=0o700, parents=True, exist_ok=True)
        lock = os.open(directory / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except OSError as error:
        raise fault(error, directory) from None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(lock)
        raise InUse(f"another gateway uses {directory}") from None
    return lock


def is_in_use(directory: Path) -> bool:
    """Say whether a gateway runs on the journal of a directory."""
    try:
        with (directory / LOCK).open("rb") as lock:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False


def _open(path: Path) -> sqlite3.Connection:
    """Open a sound file, and bring its tables to the present version.

    :raises sqlite3.DatabaseError: it is not sound.
    """
    path.touch(mode=0o600)
    path.chmod(0o600)
    connection = sqlite3.connect(path, isolation_level=None, check_same_thread=False, timeout=LOCKED_S)
    try:
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA wal_autocheckpoint = 0")  # done in quiet moments: it takes milliseconds
        connection.execute(f"PRAGMA journal_size_limit = {WAL_BYTES}")
        _require_sound(connection)
        migrate(connection)
    except BaseException:
        connection.close()
        raise
    return connection


def open_as_it_is(path: Path) -> sqlite3.Connection:
    """Open a file for reading; the index of its write-ahead log is kept in memory, not in a file beside it.

    No other program can open or write the file meanwhile. If there is none yet, it has the tables and no
    rows.

    :raises NotWritable: it cannot even be read.
    """
    if not path.exists() or not path.stat().st_size:
        connection = sqlite3.connect(":memory:", isolation_level=None)
        migrate(connection)
        return connection
    if not os.access(path, os.R_OK):
        raise NotWritable(f"{path}: {os.strerror(errno.EACCES)}")
    how = _read_only(path) if _obstacle(path) in _READ_ONLY else "mode=rw"
    uri = f"{path.absolute().as_uri()}?{how}"
    connection = sqlite3.connect(uri, uri=True, isolation_level=None, timeout=LOCKED_S)
    connection.execute("PRAGMA locking_mode = EXCLUSIVE")
    return connection


def _read_only(path: Path) -> str:
    """Options to open a file that cannot be written: without a lock, which needs a writable file."""
    with suppress(FileNotFoundError):
        if Path(f"{path}-wal").stat().st_size:
            return "mode=ro&vfs=unix-none"
    return "immutable=1"


def _require_sound(connection: sqlite3.Connection) -> None:
    """Look over the structure of a file, not over each index: that takes long."""
    (found,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    if found != "ok":
        raise sqlite3.DatabaseError(found)


def is_damage(error: ValueError | sqlite3.Error) -> bool:
    """Say whether the error means a damaged file, and not one that cannot be read."""
    code: int | None = getattr(error, "sqlite_errorcode", None)
    return code is None or code & 0xFF in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)


def fault(error: Exception, where: Path) -> OSError:
    """Say what is in the way, and whether that may go."""
    if isinstance(error, OSError):
        later = error.errno in _NO_ROOM | _READ_ONLY
        return (NotWritable if later else DiskFailed)(f"{where}: {error.strerror}")
    code = getattr(error, "sqlite_errorcode", 0)
    if code == sqlite3.SQLITE_BUSY:
        return NotWritable(f"{where}: another program holds it")
    found = errno.ENOSPC if code in _SQLITE_FULL else None if code in _SQLITE_LOST else _obstacle(where)
    if found is not None:
        return NotWritable(f"{where}: {os.strerror(found)}")
    unexplained = isinstance(error, sqlite3.OperationalError) and code not in _SQLITE_LOST
    return (_Unexplained if unexplained else DiskFailed)(f"{where}: {error}")


def _twice(attempt: Callable[[], _Gives]) -> _Gives:
    """Try again what failed for a reason that has gone since, such as a full disk that has room now."""
    try:
        return attempt()
    except _Unexplained:
        return attempt()


def _obstacle(file: Path) -> int | None:
    """Why it, or another beside it, cannot be written: SQLite has no word for most, such as a quota."""
    try:
        with TemporaryFile(dir=file.parent) as probe:
            probe.write(bytes(_PROBE_BYTES))
            probe.flush()
    except OSError as error:
        if error.errno in _NO_ROOM:
            return errno.ENOSPC
        return error.errno if error.errno in _READ_ONLY else None
    # To open the file and to close it again would end all locks that SQLite has on it.
    return errno.EACCES if file.exists() and not os.access(file, os.W_OK) else None
