"""The result of the trial of an assumption."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from commissioning.assumptions import Assumption


class Result(StrEnum):
    """How an assumption and a line go together."""

    AGREES = "agrees"
    DIFFERS = "differs"
    """The gateway is right with another setting, or all the same."""
    CANNOT_TELL = "cannot_tell"
    CONTRADICTS = "contradicts"
    """No setting makes the gateway right here: no motion before the makers of both were asked."""


@dataclass(frozen=True, slots=True)
class Change:
    """Another value of a setting of the line."""

    key: str
    """Below the line's table: `stop_mode`, `bodies.3F.power_comment`."""
    proposed: Any


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of one trial, in a sentence that says what was seen."""

    result: Result
    seen: str
    changes: tuple[Change, ...] = ()
    needed: str | None = None
    surprise: bool = False
    """Nothing more is set or moved on the line after it."""


class Unanswered(Exception):
    """A controller has not told what a trial rests on: nothing follows from that."""


def agrees(seen: str) -> Finding:
    """The assumption holds, as far as could be seen."""
    return Finding(Result.AGREES, seen)


def cannot_tell(row: Assumption, seen: str, needed: str | None = None) -> Finding:
    """Nothing was learnt."""
    return Finding(Result.CANNOT_TELL, seen, needed=needed or row.needed)


def fails(row: Assumption, seen: str, *changes: Change) -> Finding:
    """The assumption does not hold: with a setting or without harm it differs, otherwise it contradicts."""
    if changes or row.harmless:
        return Finding(Result.DIFFERS, seen, changes)
    return Finding(Result.CONTRADICTS, seen, surprise=True)
