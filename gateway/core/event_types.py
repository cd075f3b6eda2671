"""The types of events: each with its subject, its data and the version that brought it.

Each family has a table of its own; `gateway.event_types` joins them. An event of a type in none of them is
not published: the tests check every event of every plant.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from pydantic import BaseModel, ConfigDict, Field

from gateway.core.alarms import Alarm
from gateway.core.backup_record import Backup, BackupComparison
from gateway.core.leases import Lease
from gateway.core.parts import GATEWAY


class EventData(BaseModel):
    """The data of an event."""

    model_config = ConfigDict(extra="forbid", strict=True, defer_build=True)


class Nothing(EventData):
    """The type says all."""


class Swap(EventData):
    """Differences between a controller and its backup of the last night, after a loss of power."""

    night: str = Field(description="The night of the backup, as YYYY-MM-DD.")
    differing: int = Field(description="Number of settings, and of a robot's positions, that differ.")
    told: list[str] = Field(
        description="The first five differences, as in the backup and as the controller holds them."
    )
    certain: bool = Field(
        description="True if a user comment differs, which may hold a serial number: then it is another "
        "controller. Else settings that were not in flash memory may have been lost."
    )


class Unreadable(EventData):
    """Why the state could not be learned."""

    detail: str


@dataclass(frozen=True, slots=True)
class EventType:
    """One type of events."""

    name: str
    """Name of the type, such as `line.down`; words joined by dots, the subject's kind first."""
    subject: str
    """The path of what it is about, with its parts in braces; several, where it may be about several."""
    data: type[BaseModel]
    when: str
    """One sentence, without its full stop."""
    since: str = "0.1.0"
    """The version of the gateway that brought it."""
    live: bool = False
    """True for a value that is told while a client watches it, and is not kept."""


def news_types(topic: str, subject: str, data: type[BaseModel], **news: str) -> list[EventType]:
    """The types of all news of one thing, in the order of its life; the data is its record as it is then."""
    return [EventType(f"{topic}.{what}", subject, data, when) for what, when in news.items()]


def table_of(*types: Iterable[EventType]) -> Mapping[str, EventType]:
    """Join tables, by the names of the types.

    :raises ValueError: two have one name.
    """
    rows = [row for part in types for row in part]
    table = {row.name: row for row in rows}
    if len(table) < len(rows):
        raise ValueError("two types of events have one name")
    return table


MOVE_NEWS: Mapping[str, str] = {
    "queued": "a move waits for its turn",
    "sent": "its command is on the wire",
    "started": "it is seen to move",
    "succeeded": "it has ended as it should",
    "failed": "it has ended otherwise",
    "stopped": "a stop has ended it",
    "rejected": "the controller has refused its command, or has not executed it: nothing moved",
    "cancelled": "it was not sent, and will not be",
    "lost": "it could not be followed to its end",
    "unknown": "nobody can tell whether it was executed, or how it has ended",
}
"""The events of a move, in the order of its life."""


def move_types(what: str, subject: str, data: type[BaseModel]) -> list[EventType]:
    """The types of the moves of `what`; the data is the move's record as it is then."""
    return news_types(f"{what}.move", subject, data, **MOVE_NEWS)


RESTORE_NEWS: Mapping[str, str] = {
    "started": "a backup is being restored",
    "progress": "a restore has come further; once a second at most",
    "verified": "all of the backup was read back",
    "differs": "it was read back, and `differences` is what is not as in the backup",
    "failed": "nobody could read it back, or what flash memory holds is not known",
    "cancelled": "a request, a stop or the end of the gateway has ended it",
}
"""The events of a restore, in the order of its life."""


def restore_types(what: str, subject: str, data: type[BaseModel]) -> list[EventType]:
    """The types of the restores of `what`; the data is the restore's record as it is then."""
    return news_types(f"{what}.restore", subject, data, **RESTORE_NEWS)


BACKUP_NEWS: Mapping[str, str] = {
    "started": "a backup is being read",
    "progress": "more of it was read; once a second at most",
    "succeeded": "all was read: the record has the text",
    "failed": "a controller did not tell all",
    "cancelled": "a request or the end of the gateway has ended it",
}
"""The events of a backup that is read, in the order of its life."""
COMPARISON_NEWS: Mapping[str, str] = {
    **BACKUP_NEWS,
    "started": "it is being compared with a backup",
    "succeeded": "all was compared: the record has the differences",
}
"""The events of a comparison with a backup, in the order of its life."""


def backup_types(what: str, subject: str) -> list[EventType]:
    """The types of the backups of `what`, and of comparisons with them; the data is the record then."""
    return [
        *news_types(f"{what}.backup", subject, Backup, **BACKUP_NEWS),
        *news_types(f"{what}.comparison", subject, BackupComparison, **COMPARISON_NEWS),
    ]


LEASE_NEWS: Mapping[str, str] = {
    "taken": "somebody has leased it: nobody else moves or sets it",
    "released": "its holder has given a lease back",
    "expired": "a lease was not renewed in time",
    "taken_over": "an admin has leased it instead",
    "broken": "somebody else has ended a lease",
}


def lease_types(what: str, subject: str) -> list[EventType]:
    """The types of the leases of `what`."""
    return news_types(f"{what}.lease", subject, Lease, **LEASE_NEWS)


# lines

LINE = "/lines/{line_id}"


class LineDown(EventData):
    """Why a line cannot be used."""

    reason: str


class LineOwner(EventData):
    """The gateway of a plant that has a line now, and the reason."""

    reason: str
    owner: str | None = Field(description="Name of the gateway that has the line; null if unknown.")
    epoch: int = Field(description="Number of take-overs so far, plus one.")


class OrderViolated(EventData):
    """A reply that came too late: it was credited to its own command, or to none."""

    late: str = Field(description="The command whose reply came late, such as `1+M of line1.3F`.")
    before: str = Field(description="The fence that was sent after it and answered before it.")


LINES = (
    EventType("line.down", LINE, LineDown, "its port has gone, or nobody answers any more; follows each up"),
    EventType("line.owned", LINE, LineOwner, "a person has had this gateway take the line over"),
    EventType(
        "line.taken_over",
        LINE,
        LineOwner,
        "another gateway has the line, or may have it: this one does not open it again by itself",
    ),
    EventType(
        "line.order.violated",
        LINE,
        OrderViolated,
        "a reply came behind its fence: they do not keep their order; once an hour at most",
    ),
)

# the gateway and its stream

EVENTS = "/events"


class LoopHeld(EventData):
    """For how long the gateway did nothing."""

    seconds: float = Field(description="Seconds for which the event loop was held, 0.25 at least.")
    cancelled: bool = Field(
        description="True if commands that waited are not sent any more: after more than 2 s."
    )


class ShuttingDown(EventData):
    """The end of the gateway."""

    on_exit: str = Field(description="The configured treatment of motors that move: stop or leave.")


class LeftMoving(EventData):
    """A part that still moves, or is not seen to stand still, when the gateway ends."""

    move_id: str | None = Field(description="Id of its move, if it has one.")
    detail: str


class Gap(EventData):
    """The place in the stream at which events are missing."""

    requested: str = Field(description="The cursor that was asked for.")
    first_available: str = Field(description="The cursor of the oldest event that can be had.")


class JournalTrouble(EventData):
    """Why the journal cannot be written."""

    reason: str


class JournalSetAside(EventData):
    """Where a broken journal was put."""

    file: str


class Crashed(EventData):
    """The work under way when the last life of the gateway ended unasked."""

    last_seen_at: datetime | None = Field(
        description="Time at which the last life was known to run; null if it never was."
    )
    moves: list[str] = Field(description="Moves that were not over: they are followed, or resolved.")
    targets: list[str] = Field(description="The part that moves in each of these moves.")
    commands: list[str] = Field(description="Commands with an unknown outcome.")


OF_THE_GATEWAY = (
    EventType(
        "gateway.journal.trouble",
        GATEWAY,
        JournalTrouble,
        "the journal cannot be written: nothing with an effect is sent, reads and stops go on",
    ),
    EventType("gateway.journal.recovered", GATEWAY, Nothing, "the journal can be written again"),
    EventType(
        "gateway.journal.set_aside", GATEWAY, JournalSetAside, "a broken journal was replaced at the start"
    ),
    EventType(
        "gateway.crashed", GATEWAY, Crashed, "it has started after a life that did not end as it should"
    ),
    EventType("gateway.loop.held", GATEWAY, LoopHeld, "the gateway was suspended or held up"),
    EventType("gateway.shutting_down", GATEWAY, ShuttingDown, "nothing begins any more"),
    EventType("stream.gap", EVENTS, Gap, "events are missing at this place of the stream"),
)

# live values

IO = "io"


class Signal(EventData):
    """One input or output."""

    channel: int | None = Field(
        None, description="Channel of a robot: eight inputs or outputs, from 1; null for a body."
    )
    number: int = Field(description="Number of the signal, from 0; of a robot, within its channel.")
    name: str | None = Field(None, description="Name of the signal in the configuration.")
    on: bool


class Signals(EventData):
    """The inputs and outputs of a body, or of a robot's first channel."""

    inputs: list[Signal]
    outputs: list[Signal]


SIGNALS = EventType(
    IO,
    "/bodies/{body_id} or /robots/{robot_id}",
    Signals,
    "somebody watches it (`sample`); twice a second at most",
    live=True,
)


def alarm_types(of_families: Iterable[str]) -> Sequence[EventType]:
    """The types of alarms; `of_families` are the paths of what these have alarms of."""
    subject = " or ".join((GATEWAY, LINE, *of_families))
    return (
        EventType("alarm.raised", subject, Alarm, "something has gone wrong"),
        EventType(
            "alarm.reset", subject, Alarm, "somebody has seen to it, or a newer alarm stands in its place"
        ),
    )


CORE = (*LINES, *OF_THE_GATEWAY, *lease_types("line", LINE))
