"""The traffic of lines, as it was recorded and as it is."""

import asyncio
from collections.abc import AsyncIterator, Sequence
from datetime import datetime
from typing import Annotated, Final, NamedTuple

from pydantic import AwareDatetime, BaseModel, Field

from gateway.core.aside import aside
from gateway.core.errors import InvalidRequest
from gateway.core.operation import Rows, Written
from gateway.core.origin import QUESTIONS
from gateway.core.records import AnswerModel
from gateway.core.rights import Right
from gateway.door.caller import require
from gateway.door.names import LineId
from gateway.plant import Plant
from transports.trace import Record, TraceEntry, TraceFilter, TraceKind, wall_ns

ROWS: Final = Rows("lines")
MAX_TRACE_ENTRIES: Final = 10_000
AT_ONCE: Final = 500
"""Records that are formatted, and told, in one go: some milliseconds beside the event loop."""
CHECK_S: Final = 0.1
"""Seconds between looks for new records while a client follows them."""


TracedBodies = Annotated[
    str | None,
    Field(
        description="Only records about these bodies of the line, joined by commas, such as 3F,01; frames "
        "of their groups, too."
    ),
]
TracedRequest = Annotated[
    str | None,
    Field(
        max_length=128,
        description="Only frames that this request has sent (X-Request-Id), and their answers.",
    ),
]


TracedPolls = Annotated[
    bool,
    Field(
        description="False leaves out what the gateway asks by itself (fences, probes, polls, set-up, live "
        "values), with the answers."
    ),
]


class TraceRecord(AnswerModel):
    """An event at the port: bytes were received or sent, or the port opened, was lost or closed."""

    at: datetime = Field(description="UTC wall time, which jumps when the clock is set.")
    monotonic_ns: int = Field(description="A clock that never jumps.")
    kind: TraceKind
    data: str = Field(description="The bytes; unprintable ones as \\r, \\n, \\t or \\x00.")
    caller: str | None = Field(
        default=None,
        description="The caller of sent bytes: an interface and a client's address, or `gateway: fence`.",
    )
    request_id: str | None = Field(default=None, description="The X-Request-Id of the request behind it.")


class Trace(AnswerModel):
    """The newest records of a line, oldest first."""

    line_id: str
    entries: list[TraceRecord]


class News(NamedTuple):
    """Records since those that were told last."""

    number: int
    """Number of the last record that was looked at; all records of a line are counted."""
    entries: list[TraceEntry]
    missed: int
    """Records that were forgotten before they could be told."""


def filter_of(
    plant: Plant, line_id: str, bodies: str | None, request_id: str | None, *, polls: bool = True
) -> TraceFilter:
    """Build the filter for records of a line.

    :raises NotFound: there is no such line or body.
    :raises InvalidRequest: a body is on another line.
    """
    line = plant.port(line_id)
    named = [] if bodies is None else [body_id.strip() for body_id in bodies.split(",")]
    wanted = [plant.target(f"/bodies/{body_id}").address for body_id in named]
    for address in wanted:
        if not address.startswith(f"{line_id}."):
            raise InvalidRequest(f"bodies: {address} is not on line {line_id}.", "Ask its own line.")
    numbers = None if bodies is None else {int(address.rpartition(".")[2], 16) for address in wanted}
    return TraceFilter(
        line.subject_of, bodies=numbers, request_id=request_id, without=() if polls else QUESTIONS
    )


async def newest(
    plant: Plant,
    line_id: str,
    passing: TraceFilter,
    limit: int,
    since: datetime | None,
    until: datetime | None = None,
) -> list[TraceEntry]:
    """Give the newest records of a line that pass, oldest first."""
    require(plant.access, Right.VIEW, line_id)
    records = plant.history.recorders[line_id].records(since)
    if until is not None:
        latest = wall_ns(until)
        records = [record for record in records if record[0] <= latest]
    passed = await aside(_passed, passing, records, limit)
    return [entry for piece in _pieces(passed) for entry in await aside(_told, piece)]


def follow(
    plant: Plant, line_id: str, passing: TraceFilter, after: int | None, last: int = 0
) -> AsyncIterator[News | None]:
    """Tell records as they come, until the gateway ends; None where there was nothing to tell for a while.

    They begin after a number, or with the `last` that pass now.
    """
    require(plant.access, Right.VIEW, line_id)
    return _news(plant, line_id, passing, after, last)


async def _news(
    plant: Plant, line_id: str, passing: TraceFilter, after: int | None, last: int
) -> AsyncIterator[News | None]:
    recorder = plant.history.recorders[line_id]
    number = recorder.recorded if after is None else min(after, recorder.recorded)
    if after is None and last:
        for piece in _pieces(await aside(_passed, passing, recorder.records(), last)):
            yield News(number, await aside(_told, piece), 0)
    while not plant.events.closed:
        first, records = recorder.after(number)
        missed, number = first - 1 - number, first - 1 + len(records)
        passed = await aside(_passed, passing, records, len(records)) if records else []
        first_piece, *more = _pieces(passed) or [[]]
        yield News(number, await aside(_told, first_piece), missed) if passed or missed else None
        for piece in more:
            yield News(number, await aside(_told, piece), 0)
        await asyncio.sleep(CHECK_S)


def _passed(passing: TraceFilter, records: Sequence[Record], last: int) -> list[Record]:
    return list(passing.pass_on(records))[-last:] if last else []


def _pieces(records: Sequence[Record]) -> list[Sequence[Record]]:
    return [records[first : first + AT_ONCE] for first in range(0, len(records), AT_ONCE)]


def _told(records: Sequence[Record]) -> list[TraceEntry]:
    """Format records; that takes microseconds a record, and no stop may wait for thousands."""
    return list(map(TraceEntry.of, records))


@ROWS.get("/lines/{line_id}/trace", result=Trace, later=True)
async def get_trace(
    plant: Plant,
    line_id: LineId,
    *,
    limit: Annotated[
        int, Field(ge=1, le=MAX_TRACE_ENTRIES, description="Number of records, the newest.")
    ] = 1000,
    last: Annotated[
        int | None,
        Field(ge=1, le=MAX_TRACE_ENTRIES, deprecated=True, description="Another word for `limit`."),
    ] = None,
    since: Annotated[AwareDatetime | None, Field(description="Only records not before this time.")] = None,
    until: Annotated[AwareDatetime | None, Field(description="Only records not after this time.")] = None,
    bodies: TracedBodies = None,
    request_id: TracedRequest = None,
    polls: TracedPolls = True,
) -> Written:
    """Give the newest bytes of the line, a robot's too, both ways, with their times."""
    passing = filter_of(plant, line_id, bodies, request_id, polls=polls)
    found = await newest(plant, line_id, passing, last or limit, since, until)
    told = [await aside(written, found[first : first + AT_ONCE]) for first in range(0, len(found), AT_ONCE)]
    return Written(f'{{"line_id":"{line_id}","entries":[{",".join(told)}]}}')


def written(entries: Sequence[BaseModel]) -> str:
    """Write records as JSON; for thousands that takes milliseconds, in which no stop may wait."""
    return ",".join(entry.model_dump_json() for entry in entries)
