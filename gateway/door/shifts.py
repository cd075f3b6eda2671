"""A shift on one page: the moves, how each ended and its caller, as the journal has it."""

import asyncio
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from typing import Annotated, Any, Final, TypeVar

from pydantic import AwareDatetime, BaseModel, Field

from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.journal.journal import Journal
from gateway.core.journal.writes import Value
from gateway.core.operation import PlainText, Rows
from gateway.core.records import AnswerModel
from gateway.core.rights import Right
from gateway.door.audit import AuditFilter, address_of, read_beside
from gateway.door.caller import require
from gateway.door.csv_tables import CSV, csv_of
from gateway.plant import Plant

ROWS: Final = Rows("audit")
SHIFT: Final = timedelta(hours=8)
LONGEST: Final = timedelta(days=31)
_FIRST: Final = datetime.min.replace(tzinfo=UTC)
M = TypeVar("M", bound=BaseModel)
FAILED: Final = ("failed", "lost", "unknown", "rejected")
"""Ends of moves that need a look; a stopped or cancelled move was wanted so."""

_MOVES: Final = """
    SELECT id, target, at,
        json_extract(record, '$.status') AS status,
        CASE json_extract(record, '$.status') WHEN 'lost' THEN 'lost'
            ELSE coalesce(json_extract(record, '$.end_cause'), json_extract(record, '$.error.type'))
            END AS cause,
        (julianday(json_extract(record, '$.ended_at')) - julianday(json_extract(record, '$.sent_at'))) * 86400
            AS took_s,
        json_extract(record, '$.kind') AS kind,
        json_extract(record, '$.start_position') AS start,
        json_extract(record, '$.homing_distance') AS homing_distance
    FROM moves WHERE {wanted}"""
_ENDS: Final = f"SELECT status, count(*) FROM ({_MOVES}) GROUP BY status ORDER BY 2 DESC"  # noqa: S608  # no input
_AXES: Final = f"""SELECT target, count(*), sum(status = 'succeeded'), sum(status IN {FAILED}),
    round(avg(took_s), 3), round(max(took_s), 3), CASE WHEN max(took_s) IS NULL THEN NULL ELSE id END
    FROM ({_MOVES}) GROUP BY target ORDER BY 6 DESC"""  # noqa: S608  # no input
# The id is that of the longest move: SQLite takes bare columns from the row that has the max.
_FAILURES: Final = f"""SELECT coalesce(cause, status), count(*), count(DISTINCT target), max(id)
    FROM ({_MOVES}) WHERE status IN {FAILED} GROUP BY 1 ORDER BY 2 DESC"""  # noqa: S608  # no input
_HOMINGS: Final = f"""SELECT target, at, homing_distance - start FROM ({_MOVES})
    WHERE kind = 'home' AND status = 'succeeded' AND homing_distance IS NOT NULL AND start IS NOT NULL
    ORDER BY id"""  # noqa: S608  # no input
_POWER: Final = """SELECT substr(subject, instr(substr(subject, 2), '/') + 2), at FROM events
    WHERE type = 'body.power_cycled' AND at >= ? AND at < ? ORDER BY at"""
_PEOPLE: Final = """SELECT caller, sum(effect = 'motion'),
    count(DISTINCT CASE WHEN effect = 'stop' THEN coalesce(request_id, id) END),
    sum(effect IN ('setting', 'maintenance')) FROM intents WHERE {wanted} GROUP BY caller ORDER BY 2 DESC"""
_ALARMS: Final = """SELECT cause, count(*), sum(reset_at IS NULL) FROM alarms WHERE {wanted}
    GROUP BY cause ORDER BY 2 DESC"""
_OLDEST: Final = "SELECT min(at) FROM events"


class AxisOfShift(AnswerModel):
    """The moves of one body, or of one unit of a robot."""

    target: str = Field(description="Address of the body or unit: line1.3F, or r1/units/1.")
    moves: int = Field(description="Number of moves.")
    succeeded: int = Field(description="Number of moves that ended well.")
    failed: int = Field(description="Number of moves that failed, were lost or rejected, or are unknown.")
    mean_s: float | None = Field(
        description="Mean time from the command to the end, in seconds; null if nothing moved."
    )
    longest_s: float | None
    longest_move: str | None = Field(description="The id of the move that took longest.")


class FailureOfShift(AnswerModel):
    """The moves that failed for one reason."""

    cause: str = Field(description="The end's cause, such as ems; else the kind of error, or the status.")
    moves: int = Field(description="Number of moves.")
    targets: int = Field(description="Number of bodies or units concerned.")
    last_move: str = Field(description="Id of the last of these moves.")


class HomingOfShift(AnswerModel):
    """Differences between the origins that a body has found."""

    target: str
    homings: int = Field(description="Number of homings that can be compared with the one before.")
    last_off_by: int = Field(
        description="Place by the latest origin less that by the one before, in pulses or encoder counts."
    )
    largest_off_by: int = Field(description="The difference farthest from 0, in pulses or encoder counts.")


class PersonOfShift(AnswerModel):
    """The actions of one caller in the shift."""

    caller: str
    motions: int = Field(description="Number of commands that move something.")
    stops: int = Field(description="Number of requests for stops, whatever they were for.")
    settings: int = Field(description="Number of commands that change what a controller keeps.")


class AlarmOfShift(AnswerModel):
    """The alarms of one cause that were raised."""

    cause: str
    raised: int = Field(description="Number of alarms that were raised.")
    standing: int = Field(description="Number of alarms that still stand.")


class Shift(AnswerModel):
    """A shift, or any other span of time of a month at most."""

    since: datetime
    until: datetime
    known_since: datetime | None = Field(
        description="Time at which the journal begins: before it nothing is known. Null if it is empty."
    )
    moves: int = Field(description="Number of moves that were asked for.")
    ends: dict[str, int] = Field(description="Number of moves by status.")
    failures: list[FailureOfShift] = Field(description="One entry for each cause, the most frequent first.")
    axes: list[AxisOfShift] = Field(
        description="One entry for each axis, the one with the longest move first."
    )
    homings: list[HomingOfShift] = Field(
        description="Bodies that were homed after another homing, with their power kept between."
    )
    stops: int = Field(description="Number of requests for stops.")
    people: list[PersonOfShift]
    alarms: list[AlarmOfShift] = Field(description="One entry for each cause, the most frequent first.")


Since = Annotated[
    AwareDatetime | None, Field(description="Beginning of the shift; left out, eight hours before its end.")
]
Until = Annotated[AwareDatetime | None, Field(description="End of the shift; left out, now.")]
Target = Annotated[
    str | None, Field(description="Only this body, robot, or all that is on this line: arm.3F, r1, line1.")
]


@ROWS.get("/shift", any_scope=True)
async def get_shift(
    plant: Plant, *, since: Since = None, until: Until = None, target: Target = None
) -> Shift:
    """Sum up a shift: moves and their ends, failures by cause, slow axes, homings, callers, alarms.

    A key with a scope names a target in it.
    """
    require(plant.access, Right.VIEW, *([] if target is None else [target]))
    if plant.journal is None:
        raise NotFound("This gateway has no journal, so nobody knows what has moved.")
    end = until or datetime.now(UTC)
    begin = since or end - min(SHIFT, end - _FIRST)
    if not timedelta(0) < end - begin <= LONGEST:
        raise InvalidRequest("A shift ends after it begins, and within 31 days; nothing was sent.")
    wanted = AuditFilter(target=address_of(plant, target), since=begin, until=end)
    return await asyncio.to_thread(_summed_up, plant.journal, wanted)


@ROWS.get("/shift.csv", any_scope=True, media=CSV)
async def download_shift(
    plant: Plant, *, since: Since = None, until: Until = None, target: Target = None
) -> PlainText:
    """Sum up the axes of a shift as CSV, a line each; a key with a scope names a target in it."""
    shift = await get_shift(plant, since=since, until=until, target=target)
    return PlainText(csv_of(_COLUMNS, list(_lines(shift))))


_COLUMNS: Final = (*AxisOfShift.model_fields, "homings", "last_off_by", "largest_off_by")


def _lines(shift: Shift) -> Iterator[list[object]]:
    homings = {
        homing.target: [homing.homings, homing.last_off_by, homing.largest_off_by] for homing in shift.homings
    }
    for axis in shift.axes:
        cells = [*axis.model_dump().values(), *homings.get(axis.target, ["", "", ""])]
        yield ["" if cell is None else cell for cell in cells]


def _summed_up(journal: Journal, wanted: AuditFilter) -> Shift:
    """Read it beside the journal's writer, in SQLite as far as possible: nothing else waits meanwhile."""
    condition, values = wanted.condition()

    def read(sql: str, given: Sequence[Value] = values) -> list[tuple[Any, ...]]:
        return read_beside(journal, sql.format(wanted=condition), given)

    assert wanted.since is not None  # noqa: S101  # for mypy: a shift has both
    assert wanted.until is not None  # noqa: S101  # as above
    ends = dict(read(_ENDS))
    people = list(_made(PersonOfShift, read(_PEOPLE)))
    [[oldest]] = read(_OLDEST, [])
    losses = read(_POWER, [wanted.since.timestamp(), wanted.until.timestamp()])
    return Shift(
        since=wanted.since,
        until=wanted.until,
        known_since=None if oldest is None else datetime.fromtimestamp(oldest, UTC),
        moves=sum(ends.values()),
        ends=ends,
        failures=list(_made(FailureOfShift, read(_FAILURES))),
        axes=list(_made(AxisOfShift, read(_AXES))),
        homings=list(_drifts(read(_HOMINGS), losses)),
        stops=sum(person.stops for person in people),
        people=people,
        alarms=list(_made(AlarmOfShift, read(_ALARMS))),
    )


def _made(model: type[M], rows: Sequence[Sequence[Any]]) -> Iterator[M]:
    for row in rows:
        yield model(**dict(zip(model.model_fields, row, strict=True)))


def _drifts(
    homings: Sequence[tuple[str, float, int]], losses: Sequence[tuple[str, float]]
) -> Iterator[HomingOfShift]:
    """Compare each homing with the one before; a loss of power between them leaves nothing to compare."""
    found: dict[str, list[tuple[float, int]]] = {}
    for target, at, off_by in homings:
        found.setdefault(target, []).append((at, off_by))
    for target, of_target in found.items():
        lost = [at for loser, at in losses if loser == target]
        pairs = pairwise(of_target)
        off = [
            off_by
            for (before, _), (at, off_by) in pairs
            if not any(before <= lost_at < at for lost_at in lost)
        ]
        if off:
            yield HomingOfShift(
                target=target, homings=len(off), last_off_by=off[-1], largest_off_by=max(off, key=abs)
            )
