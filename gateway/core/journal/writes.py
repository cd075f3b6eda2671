"""The statements that change the journal: one for each kind of entry, and those that forget what is old.

Ages are counted in the time in which gateways have run: the wall clock may jump by years, and jump back.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

Value = str | int | float | None

RAN_S = "ran_s"
"""The fact that tells for how many seconds gateways have run on this journal: the clock of what is kept."""
KNOWN = "known "
"""Prefix of the name of a fact about a controller; its address follows."""
_NOW = f"coalesce((SELECT value FROM meta WHERE name = '{RAN_S}'), 0)"  # noqa: S608  # no input


class Write(NamedTuple):
    """One change of one row."""

    sql: str
    values: tuple[Value, ...]


def meta(name: str, value: str) -> Write:
    """Keep a fact about the journal itself."""
    return Write("INSERT OR REPLACE INTO meta VALUES (?, ?)", (name, value))


def known(address: str, fact: str) -> Write:
    """Keep what only a gateway can know of a controller."""
    return meta(KNOWN + address, fact)


def intent(
    intent_id: str,
    at: float,
    *,
    target: str,
    command: str,
    effect: str,
    frame: str,
    caller: str,
    request_id: str | None = None,
    move_id: str | None = None,
    key: str | None = None,
) -> Write:
    """Note that an action with an effect is about to be written to a line."""
    return Write(
        "INSERT INTO intents (id, at, target, command, effect, frame, caller, request_id, move_id, key, "  # noqa: S608
        f"ran_s) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, {_NOW})",
        (intent_id, at, target, command, effect, frame, caller, request_id, move_id, key),
    )


def written(intent_id: str, at: float) -> Write:
    """Note that its first byte was handed to the port."""
    return Write("UPDATE intents SET written_at = ? WHERE id = ?", (at, intent_id))


def ended(
    intent_id: str, at: float, outcome: str, detail: str | None = None, written_at: float | None = None
) -> Write:
    """Note an outcome, known or unknowable, and the time at which the first byte was handed to the port."""
    return Write(
        "UPDATE intents SET ended_at = ?1, outcome = ?2, detail = ?3, "
        "written_at = coalesce(?5, written_at) WHERE id = ?4",
        (at, outcome, detail, intent_id, written_at),
    )


def move(move_id: str, at: float, target: str, record: str, *, final: bool) -> Write:
    """The record of a move, as it is now."""
    sql = f"INSERT OR REPLACE INTO moves VALUES (?, ?, ?, ?, ?, {_NOW})"  # noqa: S608  # no input
    return Write(sql, (move_id, target, final, at, record))


def work(work_id: str, kind: str, at: float, record: str, *, over: bool) -> Write:
    """The record of long work, as it is now."""
    sql = f"INSERT OR REPLACE INTO works VALUES (?, ?, ?, ?, ?, {_NOW})"  # noqa: S608  # no input
    return Write(sql, (work_id, kind, over, at, record))


def event(number: int, at: float, type_: str, subject: str, text: str) -> Write:
    """An event, as clients read it."""
    return Write("INSERT OR REPLACE INTO events VALUES (?, ?, ?, ?, ?)", (number, at, type_, subject, text))


def alarm(
    alarm_id: str,
    at: float,
    target: str,
    cause: str,
    record: str,
    *,
    reset_at: float | None = None,
    reset_by: str | None = None,
) -> Write:
    """An alarm, as it is now."""
    return Write(
        f"INSERT OR REPLACE INTO alarms VALUES (?, ?, ?, ?, ?, ?, ?, {_NOW})",  # noqa: S608  # no input
        (alarm_id, at, target, cause, reset_at, reset_by, record),
    )


def key_used(scope: str, key: str, digest: str, at: float) -> Write:
    """The first request with an idempotency key has begun."""
    columns = "scope, key, digest, at, ran_s"
    sql = f"INSERT OR REPLACE INTO keys ({columns}) VALUES (?, ?, ?, ?, {_NOW})"  # noqa: S608  # no input
    return Write(sql, (scope, key, digest, at))


def keys_beyond(caller: str, most: int) -> Write:
    """Forget all but the newest `most` answers of one caller."""
    return Write(
        "DELETE FROM keys WHERE (scope, key) IN (SELECT scope, key FROM keys WHERE scope >= ?1 || ' ' AND "
        "scope < ?1 || '!' AND status IS NOT NULL ORDER BY ran_s DESC, at DESC LIMIT -1 OFFSET ?2)",
        (caller, most),
    )


def key_answered(scope: str, key: str, status: int, location: str | None, answer: str) -> Write:
    """Note the answer, which repetitions of the request will get, too."""
    return Write(
        "UPDATE keys SET status = ?, location = ?, answer = ? WHERE scope = ? AND key = ?",
        (status, location, answer, scope, key),
    )


def key_free(scope: str, key: str) -> Write:
    """Note that the request was refused before anything was sent: the key can be used again."""
    return Write("DELETE FROM keys WHERE scope = ? AND key = ?", (scope, key))


SLICE = 2000
"""Rows that one statement forgets at most, so that other writes wait briefly for the file."""
DAY_S = 86_400.0
REPEATED_S = 600.0
"""A client that has no answer repeats its request within this time."""
LEAST_KEPT = 10_000
"""Newest events and moves that are kept however large the file is."""
_USED_BYTES = (
    "((SELECT page_count FROM pragma_page_count) - (SELECT freelist_count FROM pragma_freelist_count)) "
    "* (SELECT page_size FROM pragma_page_size)"
)


@dataclass(frozen=True)
class Retention:
    """Bounds of the journal. Entries that are not over yet are always kept."""

    days: float = 30.0
    """Moves, intents, alarms and long work that are over; days in which gateways ran."""
    events: int = 125_000
    moves: int = 100_000
    keys_days: float = 1.0
    """Idempotency keys that were answered."""
    mebibytes: int = 1024
    """Largest size of the file; `_too_large` says what is forgotten beyond it, however young."""


def _too_large(kept: Retention, ran_s: float) -> Iterator[Write]:
    """Forget while the file is too large: who did what pays last, and of that first what all can cause.

    Answers under idempotency keys pay first, but for those that a client may still repeat its request for.
    """
    most, repeated = kept.mebibytes << 20, ran_s - REPEATED_S
    keys = "SELECT scope, key FROM keys WHERE status IS NOT NULL AND ran_s <= ? ORDER BY ran_s LIMIT ?"
    stops = "SELECT id FROM intents WHERE effect = 'stop' AND ended_at IS NOT NULL ORDER BY ran_s LIMIT ?"
    others = "SELECT id FROM intents WHERE ended_at IS NOT NULL ORDER BY ran_s LIMIT ?"
    yield Write(
        f"DELETE FROM keys WHERE {_USED_BYTES} > ? AND (scope, key) IN ({keys})",  # noqa: S608  # no input
        (most, repeated, SLICE),
    )
    yield Write(
        f"DELETE FROM events WHERE {_USED_BYTES} > ? AND number IN (SELECT number FROM events WHERE "  # noqa: S608  # no input
        "number <= (SELECT max(number) FROM events) - ? ORDER BY number LIMIT ?)",
        (most, LEAST_KEPT, SLICE),
    )
    yield Write(
        f"DELETE FROM moves WHERE {_USED_BYTES} > ? AND id IN (SELECT id FROM moves WHERE final = 1 AND "  # noqa: S608  # no input
        "id <= (SELECT id FROM moves ORDER BY id DESC LIMIT 1 OFFSET ?) LIMIT ?)",
        (most, LEAST_KEPT, SLICE),
    )
    yield Write(
        f"DELETE FROM intents WHERE {_USED_BYTES} > ? AND NOT EXISTS ({keys}) AND id IN ({stops})",  # noqa: S608  # no input
        (most, repeated, 1, SLICE),
    )
    yield Write(
        f"DELETE FROM intents WHERE {_USED_BYTES} > ? AND NOT EXISTS ({keys}) AND NOT EXISTS ({stops}) "  # noqa: S608  # no input
        f"AND id IN ({others})",
        (most, repeated, 1, 1, SLICE),
    )


def forget(ran_s: float, kept: Retention) -> list[Write]:
    """The statements that forget what is too old or too much, by how long gateways have run."""
    over = ran_s - kept.days * DAY_S
    return [
        Write(
            "DELETE FROM events WHERE number IN (SELECT number FROM events WHERE number <= "
            "(SELECT max(number) FROM events) - ? ORDER BY number LIMIT ?)",
            (kept.events, SLICE),
        ),
        Write(
            "DELETE FROM moves WHERE id IN (SELECT id FROM moves WHERE final = 1 AND (ran_s <= ? OR id <= "
            "(SELECT id FROM moves ORDER BY id DESC LIMIT 1 OFFSET ?)) LIMIT ?)",
            (over, kept.moves, SLICE),
        ),
        Write(
            "DELETE FROM intents WHERE id IN "
            "(SELECT id FROM intents WHERE ended_at IS NOT NULL AND ran_s <= ? LIMIT ?)",
            (over, SLICE),
        ),
        *_too_large(kept, ran_s),
        Write(
            "DELETE FROM keys WHERE (scope, key) IN "
            "(SELECT scope, key FROM keys WHERE status IS NOT NULL AND ran_s <= ? LIMIT ?)",
            (ran_s - kept.keys_days * DAY_S, SLICE),
        ),
        Write(
            "DELETE FROM alarms WHERE id IN "
            "(SELECT id FROM alarms WHERE reset_at IS NOT NULL AND ran_s <= ? LIMIT ?)",
            (over, SLICE),
        ),
        Write(
            "DELETE FROM works WHERE id IN (SELECT id FROM works WHERE over = 1 AND ran_s <= ? LIMIT ?)",
            (over, SLICE),
        ),
    ]
