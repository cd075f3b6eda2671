"""A journal opened for a life of the gateway, with what it tells of the lives before."""

import json
import logging
import re
import secrets
import sqlite3
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from gateway.core.journal import writes
from gateway.core.journal.disk import FILE, Disk, DiskFailed, InUse, NotWritable, SqliteDisk, is_damage
from gateway.core.journal.journal import Journal
from gateway.core.journal.writes import Value, Write

EPOCHS_KEPT: Final = 100


class PastEvent(NamedTuple):
    """An event of an earlier life."""

    type: str
    subject: str
    text: str


class OpenIntent(NamedTuple):
    """An action with an effect whose outcome the journal does not know."""

    id: str
    target: str
    command: str
    written: bool
    """True if its first byte was handed to the port, as far as the journal knows."""
    moves: Sequence[str]
    """The moves it was to make."""


class Beginning(NamedTuple):
    """The state that the last life left, from which this one goes on."""

    epoch: str
    """Epoch of the events, whose numbers go on.

    After a crash it is another one: clients may have read events that the journal does not have.
    """
    earlier: Mapping[str, int]
    """The epochs before, each with the number of its last event."""
    last_event: int
    was_clean: bool
    """True if the last life ended as it should; also for the first."""
    seen_at: float | None
    """Time at which the last life was last known to run, by the wall clock."""
    moves: Sequence[str]
    """The newest records of moves, as JSON, those that were not over among them, in their order."""
    events: Sequence[PastEvent]
    """The newest, without a hole, up to the last."""
    open_intents: Sequence[OpenIntent]
    begun: frozenset[str] = frozenset()
    """The moves that are not over, of which a command may have been written."""
    prepared: Mapping[str, Sequence[str]] = MappingProxyType({})
    """Frames without CR that may have been written to prepare a move, by the move that is not over."""
    alarms: Sequence[str] = ()
    """The newest records of alarms, as JSON, those that stand among them, in their order."""
    ran_s: float = 0.0
    """Seconds for which gateways have run on this journal."""
    known: Mapping[str, str] = MappingProxyType({})
    """Facts that only a gateway can know of a controller, by address."""
    last_id: str = "0"
    """The greatest id of moves, intents, alarms and long work, whatever the clock was when it was drawn."""
    works: Sequence[tuple[str, str]] = ()
    """The kinds and the newest records of long work, as JSON, those that were not over among them, in their
    order."""


def begin(disk: Disk) -> Beginning:
    """Read what the last life has left, and note that this one has begun.

    :raises NotWritable, DiskFailed: that could not be noted.
    """
    found = left_in(disk)
    disk.commit(begun(found), durable=True)
    return found


def left_in(
    disk: Disk,
    most_events: int = 125_000,
    most_moves: int = 1000,
    most_alarms: int = 1000,
    most_works: int = 200,
) -> Beginning:
    """Read what the last life has left."""
    known: dict[str, str] = dict(disk.rows("SELECT name, value FROM meta"))
    [(last,)] = disk.rows("SELECT coalesce(max(number), 0) FROM events")
    was_clean = known.get("clean", "1") == "1"
    earlier: dict[str, int] = json.loads(known.get("epochs", "{}"))
    epoch = known.get("epoch")
    if epoch is not None and not was_clean:
        earlier = dict([*earlier.items(), (epoch, int(last))][-EPOCHS_KEPT:])
        epoch = None
    return Beginning(
        epoch=epoch or secrets.token_hex(4),
        earlier=earlier,
        last_event=int(last),
        was_clean=was_clean,
        seen_at=float(known["seen_at"]) if "seen_at" in known else None,
        moves=_moves(disk, most_moves),
        events=_events(disk, int(last), most_events),
        open_intents=_open_intents(disk),
        begun=frozenset(_begun(disk)),
        prepared=_prepared(disk),
        alarms=_alarms(disk, most_alarms),
        ran_s=float(known.get(writes.RAN_S, 0.0)),
        known={
            name.removeprefix(writes.KNOWN): fact
            for name, fact in known.items()
            if name.startswith(writes.KNOWN)
        },
        last_id=_last_id(disk),
        works=_works(disk, most_works),
    )


def begun(life: Beginning) -> list[Write]:
    """Writes that note the beginning of a life."""
    facts = {
        "epoch": life.epoch,
        "epochs": json.dumps(dict(life.earlier)),
        "clean": "0",
        "seen_at": str(time.time()),
    }
    return [writes.meta(name, value) for name, value in facts.items()]


def anew() -> Beginning:
    """The beginning of a life without a past."""
    return Beginning(secrets.token_hex(4), {}, 0, True, None, (), (), ())


def _moves(disk: Disk, most: int) -> list[str]:
    newest = "SELECT id FROM moves WHERE final = 1 ORDER BY id DESC LIMIT ?"
    sql = f"SELECT record FROM moves WHERE final = 0 OR id IN ({newest}) ORDER BY id"  # noqa: S608  # no input
    return [record for (record,) in disk.rows(sql, (most,))]


def _alarms(disk: Disk, most: int) -> list[str]:
    newest = "SELECT id FROM alarms WHERE reset_at IS NOT NULL ORDER BY id DESC LIMIT ?"
    sql = f"SELECT record FROM alarms WHERE reset_at IS NULL OR id IN ({newest}) ORDER BY id"  # noqa: S608  # no input
    return [record for (record,) in disk.rows(sql, (most,))]


def _works(disk: Disk, most: int) -> list[tuple[str, str]]:
    newest = "SELECT id FROM works WHERE over = 1 ORDER BY id DESC LIMIT ?"
    sql = f"SELECT kind, record FROM works WHERE over = 0 OR id IN ({newest}) ORDER BY id"  # noqa: S608  # no input
    return [(kind, record) for kind, record in disk.rows(sql, (most,))]


def _last_id(disk: Disk) -> str:
    """Find the greatest id of all tables; a damaged one counts for nothing."""
    tables = ("moves", "intents", "alarms", "works")
    greatest = [disk.rows(f"SELECT id FROM {table} ORDER BY id DESC LIMIT 1") for table in tables]  # noqa: S608  # no input
    ids = [str(last) for rows in greatest for (last,) in rows]
    return max(filter(re.compile("[0-9a-f]{20}").fullmatch, ids), default="0")


def _events(disk: Disk, last: int, most: int) -> list[PastEvent]:
    """Read backwards up to the first hole: what a disk in trouble did not take."""
    sql = "SELECT number, type, subject, text FROM events ORDER BY number DESC LIMIT ?"
    found: list[PastEvent] = []
    for number, *event in disk.rows(sql, (most,)):
        if number != last - len(found):
            break
        found.append(PastEvent(*event))
    return found[::-1]


def _open_intents(disk: Disk) -> list[OpenIntent]:
    sql = "SELECT id, target, command, written_at, move_id FROM intents WHERE ended_at IS NULL ORDER BY id"
    return [
        OpenIntent(intent_id, target, command, written_at is not None, (moves or "").split())
        for intent_id, target, command, written_at, moves in disk.rows(sql)
    ]


def _prepared(disk: Disk) -> dict[str, list[str]]:
    sql = (
        "SELECT moves.id, frame FROM moves JOIN intents ON move_id = moves.id "
        "WHERE final = 0 AND effect != 'motion' AND coalesce(outcome, '') != 'not_sent' ORDER BY intents.id"
    )
    found: dict[str, list[str]] = {}
    for move_id, frame in disk.rows(sql):
        found.setdefault(move_id, []).append(frame.strip())
    return found


def _begun(disk: Disk) -> Iterator[str]:
    """Find moves with an intent, whatever their records say: those are written without waiting."""
    sent = "SELECT 1 FROM intents WHERE {} AND coalesce(outcome, '') != 'not_sent' LIMIT 1"
    for (move_id,) in disk.rows("SELECT id FROM moves WHERE final = 0"):
        alone = disk.rows(sent.format("move_id = ?"), (move_id,))
        if alone or disk.rows(sent.format("move_id LIKE ?"), (f"%{move_id}%",)):
            yield move_id


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
