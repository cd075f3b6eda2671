"""The audit trail: every action with an effect, its caller and its outcome, as the journal has it."""

import asyncio
import sqlite3
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Annotated, Any, Final

from pydantic import AwareDatetime, Field

from gateway.core.aside import aside
from gateway.core.errors import NotFound
from gateway.core.journal.journal import Journal, JournalUnavailable
from gateway.core.journal.writes import Value
from gateway.core.operation import Rows
from gateway.core.records import AnswerModel, Record
from gateway.core.rights import Right
from gateway.door.caller import require
from gateway.plant import Plant

ROWS: Final = Rows("audit")
_COLUMNS: Final = (
    *("id", "at", "caller", "request_id", "target", "command", "effect", "frame", "move_id"),
    *("written_at", "ended_at", "outcome", "detail"),
)


class Deed(Record):
    """An action with an effect that a caller asked for, and its outcome."""

    id: str = Field(
        description="Id of the action, which sorts by time; also the cursor before which older actions lie."
    )
    at: datetime
    caller: str = Field(description="The caller: the name of a key, an interface and an address.")
    request_id: str | None = Field(description="The X-Request-Id of the request.")
    target: str = Field(
        description="Address of the body, group or robot: line1.3F, line1.80 for a group, r1."
    )
    command: str = Field(description="The row of the command table.")
    effect: str = Field(description="Effect of the command: motion, stop, setting or maintenance.")
    frame: str = Field(description="The exact bytes for the controller.")
    moves: list[str] = Field(description="Ids of the moves that the command was to make.")
    written_at: datetime | None = Field(
        description="Time at which the frame was handed to the port; null if it was not."
    )
    ended_at: datetime | None = Field(
        description="Time at which the outcome was known; null while it is not."
    )
    outcome: str | None = Field(
        description="Outcome: answered, refusal, failure, not_sent, or unknown: it may have been executed "
        "or not."
    )
    detail: str | None = Field(
        description="Reason for which it was not carried out, or the controller's error."
    )


def _before(mark: str) -> str:
    """The line that a target's address begins with, or the robot."""
    return f"substr(target, 1, instr(target, '{mark}') - 1)"


@dataclass(frozen=True)
class AuditFilter:
    """The actions to list; a criterion that is None does not count."""

    caller: str | None = None
    """A part of the caller's name."""
    target: str | None = None
    """An address, a line for all that is on it, or a robot for its units."""
    since: datetime | None = None
    until: datetime | None = None
    before: str | None = None
    """Id of the action before which the page ends."""

    def condition(self) -> tuple[str, list[Value]]:
        """Give the condition in SQL, with its values."""
        parts: list[tuple[str, Value]] = []
        if self.caller is not None:
            parts.append(("instr(caller, ?) > 0", self.caller))
        if self.target is not None:
            parts.append((f"? IN (target, {_before('.')}, {_before('/')})", self.target))
        if self.since is not None:
            parts.append(("at >= ?", self.since.timestamp()))
        if self.until is not None:
            parts.append(("at < ?", self.until.timestamp()))
        if self.before is not None:
            parts.append(("id < ?", self.before))
        return " AND ".join(sql for sql, _ in parts) or "1", [value for _, value in parts]


async def deeds(plant: Plant, wanted: AuditFilter, limit: int) -> Sequence[Deed]:
    """Read up to `limit` actions, the newest first, beside the journal's writer, which does not wait for it.

    :raises NotFound: there is no journal.
    :raises JournalUnavailable: it cannot be read.
    """
    require(plant.access, Right.VIEW, *([] if wanted.target is None else [wanted.target]))
    if plant.journal is None:
        raise NotFound("This gateway has no journal, so nobody knows who did what.")
    condition, values = replace(wanted, target=address_of(plant, wanted.target)).condition()
    sql = f"SELECT {', '.join(_COLUMNS)} FROM intents WHERE {condition} ORDER BY id DESC LIMIT ?"  # noqa: S608  # no input
    rows = await asyncio.to_thread(read_beside, plant.journal, sql, [*values, limit])
    return await aside(_deeds, rows)


def read_beside(journal: Journal, sql: str, values: Sequence[Value]) -> list[tuple[Any, ...]]:
    """Read rows of the journal beside its writer, in a thread: that may take long.

    :raises JournalUnavailable: it cannot be read.
    """
    try:
        return journal.disk.read_apart(sql, values)
    except sqlite3.Error as error:
        raise JournalUnavailable(str(error)) from None


def address_of(plant: Plant, given: str | None) -> str | None:
    """The whole address of what was named shortly; a line, or what there is no more, stays as it is."""
    with suppress(NotFound):
        return given and plant.access.territory.named(given).address
    return given


def _deeds(rows: Sequence[tuple[Any, ...]]) -> list[Deed]:
    return list(map(_deed, rows))


def _deed(row: tuple[Any, ...]) -> Deed:
    told = dict(zip(_COLUMNS, row, strict=True))
    times = {name: _utc(told.pop(name)) for name in ("at", "written_at", "ended_at")}
    return Deed(moves=(told.pop("move_id") or "").split(), **told, **times)


def _utc(at: float | None) -> datetime | None:
    return None if at is None else datetime.fromtimestamp(at, UTC)


class Audit(AnswerModel):
    """Actions, the newest first."""

    deeds: list[Deed]
    cursor: str | None = Field(
        description="Cursor of the next page, with older actions; null if there is none."
    )


@ROWS.get("/audit", any_scope=True)
async def list_deeds(
    plant: Plant,
    *,
    caller: Annotated[
        str | None, Field(description="Only actions of callers whose name contains this.")
    ] = None,
    target: Annotated[
        str | None,
        Field(description="Only actions on this body or group with its line, or robot: arm.3F, r1."),
    ] = None,
    since: Annotated[AwareDatetime | None, Field(description="Only actions at or after this time.")] = None,
    until: Annotated[AwareDatetime | None, Field(description="Only actions before this time.")] = None,
    cursor: Annotated[
        str | None, Field(pattern="^[0-9a-f]{20}$", description="Only actions older than this cursor.")
    ] = None,
    limit: Annotated[int, Field(ge=1, le=1000)] = 100,
) -> Audit:
    """List actions with an effect, over restarts: caller, target, command and outcome.

    A key with a scope names a target in it.
    """
    found = await deeds(plant, AuditFilter(caller, target, since, until, cursor), limit)
    return await aside(_told, found, limit)


def _told(found: Sequence[Deed], limit: int) -> Audit:
    return Audit(deeds=list(found), cursor=found[-1].id if len(found) == limit else None)
