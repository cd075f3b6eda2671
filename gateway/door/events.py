"""Events as a list: what has happened after a cursor."""

from collections.abc import Collection
from functools import cache
from typing import Annotated, Final

from pydantic import Field

from gateway.access.principal import current
from gateway.core.addresses import canonical_address, there_are
from gateway.core.errors import InvalidRequest
from gateway.core.events import FASTEST_HZ, SLOWEST_HZ, Event, SlowConsumer, Subscription, Writer
from gateway.core.operation import Rows, Written
from gateway.door.event_models import EventList
from gateway.door.names import CALLED, COLLECTIONS
from gateway.event_types import EVENT_TYPES
from gateway.plant import Plant
from protocols.wording import joined, shown, unknown

__all__ = [
    "FASTEST_HZ",
    "ROWS",
    "SLOWEST_HZ",
    "After",
    "Bodies",
    "Event",
    "Limit",
    "Sample",
    "SlowConsumer",
    "Snapshot",
    "Subscription",
    "Types",
    "Writer",
    "addresses_of",
    "list_events",
    "types_of",
]

ROWS: Final = Rows("events")

After = Annotated[str | None, Field(description="Only events after this cursor.")]
Bodies = Annotated[
    str | None,
    Field(
        description=f"Only events of these {joined(*CALLED)}: addresses joined by "
        "commas, such as 3F,arm.02,wafer,r1,r2/units/1. A robot's address means its units too."
    ),
]
Types = Annotated[
    str | None,
    Field(description="Only events of these types, joined by commas, such as body.move.*,line.down."),
]


Sample = Annotated[
    float | None,
    Field(
        ge=SLOWEST_HZ,
        le=FASTEST_HZ,
        description="Highest rate of each live value (body.position, robot.position, io) in Hz; left out, "
        "there are none. They are no events: a new value takes the place of one that was not sent yet.",
    ),
]


Snapshot = Annotated[
    bool,
    Field(
        description="True to begin with a stream.snapshot, the present state of all wanted parts. It "
        "includes the events up to its `as_of`."
    ),
]


Limit = Annotated[int, Field(ge=1, le=1000)]


@ROWS.get("/events", about="bodies", result=EventList, later=True)
async def list_events(
    plant: Plant,
    *,
    after: After = None,
    bodies: Bodies = None,
    types: Types = None,
    limit: Limit = 100,
    sample: Sample = None,
) -> Written:
    """List events after a cursor, or from the oldest event that is kept.

    Ask again after the answer's `cursor` to go on. The event `stream.gap` stands for events no longer kept.
    With `sample` the values that are watched follow the events, as read within a second.
    """
    wanted = addresses_of(plant, bodies), types_of(types)
    page = await plant.events.since(after, *wanted, limit)
    values = [] if sample is None else await plant.events.values(*wanted, sample)
    events = ",".join(event.json for event in (*page.events, *values))
    return Written(f'{{"events":[{events}],"cursor":"{page.cursor}"}}')


def addresses_of(plant: Plant, text: str | None) -> list[str] | None:
    """Read addresses of what there is.

    :raises InvalidRequest: one of them is no address, or of nothing in the configuration.
    """
    wanted = _split(text)
    known = plant.addresses()
    for address in map(canonical_address, wanted or ()):
        if address not in known:
            # Who may see a part only is not told the names of the rest.
            listed = f"; {there_are(sorted(known))}" if current().scope is None else ""
            raise InvalidRequest(
                f"bodies: there is no {address}{listed}.",
                f"GET {', '.join(COLLECTIONS)} list what there is.",
            )
    return wanted


def types_of(text: str | None) -> list[str] | None:
    """Read types of events that there are.

    :raises InvalidRequest: one of them is none, so nothing would ever come.
    """
    wanted = _split(text)
    kinds, known = _known_types()
    for given in wanted or ():
        if given not in known:
            raise InvalidRequest(
                f"types: there is no {shown(given)} ({unknown(given, known, kinds)}).",
                "Give types such as line.down or body.move.*; docs/events.md has all of them.",
            )
    return wanted


@cache
def _known_types() -> tuple[Collection[str], Collection[str]]:
    """The kinds of types, such as `body.*`, and all that types can be asked for by."""
    names = [name.split(".") for name in EVENT_TYPES]
    beginnings = [(*words[:most], "*") for words in names for most in range(1, len(words))]
    known = dict.fromkeys(map(".".join, (*beginnings, *names)))
    return sorted(pattern for pattern in known if pattern.count(".") < 2 and pattern.endswith("*")), known


def _split(text: str | None) -> list[str] | None:
    return [part.strip() for part in text.split(",")] if text else None
