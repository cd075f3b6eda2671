"""Retention: old entries are forgotten by age and by number, a few at a time.

Ages are counted in the time in which gateways have run: the wall clock may jump by years, and jump back.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from gateway.core.journal.writes import Write

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
