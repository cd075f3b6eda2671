"""A journal opened for a life of the gateway, with what it tells of the lives before."""

import logging
import sqlite3
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, NamedTuple

from gateway.core.journal.beginning import Beginning, anew, begun, left_in
from gateway.core.journal.disk import FILE, DiskFailed, InUse, NotWritable, SqliteDisk, is_damage
from gateway.core.journal.journal import Journal
from gateway.core.journal.writes import Value, Write

log = logging.getLogger(__name__)

SLOW_BYTES_PER_S: Final = 2 << 20
"""Bytes a second of a disk that hardly suffices, beside the other work of its machine."""


class OpenedJournal(NamedTuple):
    """A journal, and what was found in it."""

    journal: Journal
    past: Beginning
    set_aside: Path | None = None
    """File to which a broken journal was moved, in whose place a new one was begun."""


class NoDisk:
    """In the place of a disk that could not be opened: it takes nothing, for as long as the process lives."""

    def __init__(self, why: str) -> None:
        self._why = why

    def commit(self, _writes: Sequence[Write], *, durable: bool) -> None:
        """Refuse."""
        raise DiskFailed(self._why + (" (it had to be durable)" if durable else ""))

    def rows(self, _sql: str, _values: Sequence[Value] = ()) -> list[tuple[Any, ...]]:
        """Nothing is there."""
        return []

    def read_apart(self, _sql: str, _values: Sequence[Value] = ()) -> list[tuple[Any, ...]]:
        """Nothing is there."""
        return []

    def check(self) -> None:
        """Refuse."""
        raise DiskFailed(self._why)

    def tidy(self) -> None:
        """Nothing is to be tidied."""

    def close(self) -> None:
        """Nothing is open."""


def longest_s(directory: Path) -> float:
    """Longest time in seconds to look over the journal of a directory, and to bring it to this version."""
    size = 0
    for name in (FILE, f"{FILE}-wal"):
        with suppress(OSError):
            size += (directory / name).stat().st_size
    return size / SLOW_BYTES_PER_S


def open_journal(
    directory: Path,
    make_sense: Callable[[Beginning], object] = lambda _: None,
    open_disk: Callable[[Path], SqliteDisk] = SqliteDisk,
) -> OpenedJournal:
    """Open the journal of a directory; where that is not possible, one that is in trouble from the start.

    A journal for which `make_sense` raises ValueError is set aside, as one that is not sound is.

    :raises InUse: another gateway has it open.
    :raises TooNew: a later version of the gateway has written it.
    """
    try:
        disk = open_disk(directory)
        journal, past = _begin(disk, make_sense)
    except InUse:
        raise
    except (OSError, sqlite3.Error) as error:
        log.error(  # noqa: TRY400  # one sentence says all
            "the journal in %s cannot be used: %s; only reads and stops are sent", directory, error
        )
        return OpenedJournal(
            Journal(NoDisk(str(error)), trouble=str(error), failure=DiskFailed(str(error))), anew()
        )
    if disk.set_aside is not None:
        log.error(
            "the journal was broken: it is now %s, and a new one was begun; what was under way is not known",
            disk.set_aside,
        )
    return OpenedJournal(journal, past, disk.set_aside)


def _begin(disk: SqliteDisk, make_sense: Callable[[Beginning], object]) -> tuple[Journal, Beginning]:
    """Read the past, and note that a life has begun; on a full disk that is done when it has room."""
    try:
        past = _past(disk, make_sense)
        journal = Journal(disk, ran_s=past.ran_s)
        try:
            disk.commit(begun(past), durable=True)
        except NotWritable as full:
            log.error("the journal cannot be written: %s; only reads and stops are sent", full)  # noqa: TRY400  # one sentence says all
            journal.owe(begun(past), full)
    except BaseException:
        disk.close()
        raise
    return journal, past


def _past(disk: SqliteDisk, make_sense: Callable[[Beginning], object]) -> Beginning:
    try:
        past = left_in(disk)
        make_sense(past)
    except (ValueError, sqlite3.Error) as error:
        if not is_damage(error):
            raise
        log.error("the journal makes no sense: %s", error)  # noqa: TRY400  # one sentence says all
        disk.begin_anew()
        return anew()
    return past
