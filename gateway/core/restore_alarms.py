"""Alarms of restores that did not end well, in words for a technician."""

from collections.abc import Iterator
from typing import Final

from gateway.core.alarms import Cause, Facts, words_of
from gateway.core.next_calls import get

RESTORE: Final = get("{subject}/restores/{restore_id}", "restore")


def causes_of_restores(what: str, manual: str) -> Iterator[Cause]:
    """The ways in which a restore of a body, a robot or a line ends badly."""
    for how in ("failed", "differs"):
        name = f"{what}.restore.{how}"
        yield Cause(name, name, words_of(f"restore.{how}"), manual, (RESTORE,), facts=_facts)


def _facts(record: Facts) -> Facts:
    return {
        "restore_id": record["id"],
        "request_id": record["request_id"],
        "detail": (record["error"] or {}).get("detail", ""),
    }
