"""What a journal tells at the start of the gateway: where the last life ended, and whether it ended well."""

import secrets
import time
from typing import NamedTuple

from gateway.core.journal import writes
from gateway.core.journal.disk import Disk


class Beginning(NamedTuple):
    """What was found, and what this life goes on from."""

    epoch: str
    """Of the events, whose numbers go on: another one only when the journal is another."""
    last_event: int
    was_clean: bool
    """Whether the last life ended by itself; True for the first."""
    seen_at: float | None
    """When the last life was last known to live, by the wall clock."""
    open_moves: list[str]
    """Records of moves that were not over, as JSON."""


def begin(disk: Disk) -> Beginning:
    """Read what the last life has left, and note that this one has begun.

    :raises DiskFull, DiskFailed: that could not be noted.
    """
    known: dict[str, str] = dict(disk.rows("SELECT name, value FROM meta"))
    [(last,)] = disk.rows("SELECT coalesce(max(number), 0) FROM events")
    found = Beginning(
        epoch=known.get("epoch") or secrets.token_hex(4),
        last_event=max(int(last), int(known.get("last_event", 0))),
        was_clean=known.get("clean", "1") == "1",
        seen_at=float(known["seen_at"]) if "seen_at" in known else None,
        open_moves=[
            record for (record,) in disk.rows("SELECT record FROM moves WHERE final = 0 ORDER BY id")
        ],
    )
    facts = {"epoch": found.epoch, "clean": "0", "seen_at": str(time.time())}
    disk.commit([writes.meta(name, value) for name, value in facts.items()], durable=True)
    return found
