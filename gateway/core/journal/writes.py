"""The writes to the journal: one statement with its values for each kind of entry."""

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
