"""The plant as it was at a moment, as far as the journal has it, over restarts."""

import asyncio
import json
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from typing import Annotated, Any, Final, Literal

from pydantic import AwareDatetime, Field, JsonValue

from gateway.core.alarms import Alarm
from gateway.core.errors import NotFound
from gateway.core.journal.journal import Journal
from gateway.core.operation import Rows
from gateway.core.records import AnswerModel
from gateway.door.audit import read_beside
from gateway.plant import Plant

ROWS: Final = Rows("audit")
_MOVES: Final = "SELECT target, record, max(id) FROM moves WHERE at <= ? GROUP BY target ORDER BY target"
# SQLite takes bare columns from the row that has the max.
_STATES: Final = """SELECT subject, type, max(number) FROM events WHERE at <= ?
    AND type IN ('body.online', 'body.offline', 'robot.online', 'robot.offline', 'line.up', 'line.down')
    GROUP BY subject"""
_ALARMS: Final = (
    "SELECT record FROM alarms WHERE at <= ? AND (reset_at IS NULL OR reset_at > ?) ORDER BY at DESC"
)
_OLDEST: Final = "SELECT min(at) FROM events"
_UNREACHED: Final = ("offline", "down")


class PlaceThen(AnswerModel):
    """Place of a motor, or of a unit's axes, by the last move before the moment."""

    target: str = Field(description="Address of the part: line1.3F, r1/units/1 or wafer.")
    state: Literal["moving", "standing"]
    position: JsonValue = Field(
        description="Position as moves have it: pulses or encoder counts, or by axis; on the way it is "
        "interpolated by time between start and end. Null if unknown."
    )
    move_id: str = Field(description="Id of the move that was under way, or of the last one.")


class Moment(AnswerModel):
    """The plant as it was."""

    at: datetime
    known_since: datetime | None = Field(description="Time at which the journal begins; null if it is empty.")
    places: list[PlaceThen] = Field(description="Places of all parts that had moved by then.")
    unreached: list[str] = Field(description="Addresses of bodies, robots and lines that did not answer.")
    alarms: list[Alarm] = Field(description="Alarms that stood at that moment, newest first.")


@ROWS.get("/moment", whole_plant=True)
async def get_moment(
    plant: Plant,
    *,
    at: Annotated[AwareDatetime | None, Field(description="The moment; left out, now.")] = None,
) -> Moment:
    """Tell where everything was at a moment, which parts did not answer, and which alarms stood.

    The journal answers: nothing is sent to a controller. The trace has what went over a line then.

    :raises NotFound: this gateway keeps no journal.
    """
    if plant.journal is None:
        raise NotFound("This gateway keeps no journal; nothing was sent.", "Start it with --data.")
    return await asyncio.to_thread(_read, plant.journal, at or datetime.now(UTC))


def _read(journal: Journal, at: datetime) -> Moment:
    """Read it beside the journal's writer; errors as of `read_beside`."""
    now = at.timestamp()
    [[oldest]] = read_beside(journal, _OLDEST, [])
    states = read_beside(journal, _STATES, [now])
    alarms = [Alarm.model_validate_json(text) for [text] in read_beside(journal, _ALARMS, [now, now])]
    return Moment(
        at=at,
        known_since=None if oldest is None else datetime.fromtimestamp(oldest, UTC),
        places=list(_places(read_beside(journal, _MOVES, [now]), at)),
        unreached=sorted(
            subject.rpartition("/")[2] for subject, what, _ in states if what.endswith(_UNREACHED)
        ),
        alarms=[_as_of(alarm, at) for alarm in alarms],
    )


def _as_of(alarm: Alarm, at: datetime) -> Alarm:
    """An alarm without what came after the moment."""
    lasted = alarm.ended_at is None or alarm.ended_at > at
    return alarm.model_copy(
        update={"reset_at": None, "reset_by": None} | ({"ended_at": None} if lasted else {})
    )


def _places(rows: list[tuple[Any, ...]], at: datetime) -> Iterator[PlaceThen]:
    for target, text, move_id in rows:
        move: Mapping[str, Any] = json.loads(text)
        sent, ended = _time(move["sent_at"]), _time(move["ended_at"])
        start, end = move.get("start_position", move.get("start")), move.get("position")
        moving = sent is not None and sent <= at and (ended is None or ended > at)
        if moving:
            assert sent is not None  # noqa: S101  # for mypy: it was sent
            last = end if ended is not None else move.get("target_position", move.get("target"))
            share = 0.0 if ended is None else (at - sent) / (ended - sent)
            position = _between(start, last, share)
        else:
            position = start if ended is None or ended > at else end
        yield PlaceThen(
            target=target, state="moving" if moving else "standing", position=position, move_id=move_id
        )


def _time(text: str | None) -> datetime | None:
    return None if text is None else datetime.fromisoformat(text)


def _between(start: Any, end: Any, share: float) -> Any:
    """A place on the way; axes one by one. Null where one of both is not known."""
    if isinstance(start, dict) and isinstance(end, dict):
        return {axis: _between(place, end.get(axis), share) for axis, place in start.items()}
    if isinstance(start, int | float) and isinstance(end, int | float):
        return round(start + share * (end - start), 3)
    return None
