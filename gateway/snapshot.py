"""The plant as it is now, after a gap in the stream, so that a client need not read everything again."""

from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any, Final, Union

from pydantic import Field, create_model

from gateway.core.event_types import EVENTS, EventData, EventType
from gateway.core.events import SNAPSHOT, Filter
from gateway.core.family import AnyLine, Family, Registered
from gateway.core.line_state import LineState
from gateway.core.records import Record
from gateway.families import registered


class LineNow(Record):
    """A line."""

    line_id: str
    state: LineState
    down_reason: str | None


class Snapshot(EventData):
    """The plant when the event was made; later events up to `as_of` are in it already."""

    as_of: str = Field(description="The cursor of the newest event that it takes account of.")
    lines: list[LineNow] = Field(
        description="State of the lines; empty if only some bodies or robots were asked for."
    )


def model_of(kinds: Iterable[type[Registered]]) -> type[EventData]:
    """Describe a snapshot with all that families, and what extends them, tell."""
    own = list(kinds)
    move: Any = Union[tuple(record for kind in own for record in kind.move_records)]  # noqa: UP007
    fields: dict[str, Any] = {kind.collections[0]: list[kind.now] for kind in own if issubclass(kind, Family)}  # type: ignore[name-defined]
    fields["moves"] = list[move], Field(description="Moves that are not over.")
    return create_model("Snapshot", __base__=Snapshot, __doc__=Snapshot.__doc__, **fields)


TYPES: Final = (
    EventType(
        SNAPSHOT,
        EVENTS,
        model_of(registered()),
        "follows each gap: all that is known now of what is wanted",
    ),
)


def taking(
    registered: Collection[Registered], ports: Mapping[str, AnyLine]
) -> Callable[[Filter, str], EventData]:
    """Give what makes a snapshot of a plant for a client, who wants some of it, at a cursor."""
    model = model_of(map(type, registered))

    def take(wanted: Filter, as_of: str) -> EventData:
        logs = (log for package in registered for log in package.move_logs())
        told: dict[str, Any] = {
            "as_of": as_of,
            "lines": [] if wanted.bodies else [_line(line) for line in ports.values()],
            "moves": [move for log in logs for move in log.under_way() if wanted.wants_address(move.body_id)],
        }
        for family in (package for package in registered if isinstance(package, Family)):
            seen = (seen.now for seen in family.seen() if wanted.wants_address(seen.address))
            told[family.collections[0]] = list(seen)
        return model(**told)

    return take


def _line(line: AnyLine) -> LineNow:
    return LineNow(line_id=line.id, state=line.state, down_reason=line.trouble)
