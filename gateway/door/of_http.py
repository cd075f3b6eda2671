"""Rows that HTTP alone serves, each with its reason: `api` answers them by functions of its own."""

from collections.abc import Callable
from typing import Annotated, Final, Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from gateway.access.grants import TICKET_S
from gateway.core.line_state import LineState
from gateway.core.marks import DETAIL
from gateway.core.operation import Rows
from gateway.core.records import AnswerModel
from gateway.core.rights import Right
from gateway.door.events import After, Bodies, Sample, Snapshot, Types
from gateway.door.names import LineId
from gateway.door.traces import MAX_TRACE_ENTRIES, TracedBodies, TracedPolls, TracedRequest
from gateway.plant import Plant

STREAMS: Final = Rows("streams")
HEALTH: Final = Rows("health")
TICKETS: Final = Rows("system")
RECORDINGS: Final = Rows("recordings")
STREAM: Final = "it is a stream, which has no end"
FILE: Final = "it is a file, which is sent as it is read"
FIGURES: Final = "it is the text that Prometheus reads"
TICKET: Final = "it is for those who can send no header"
STATUS: Final = "its status is the answer, for what watches processes over HTTP"

_USABLE: Final = (LineState.READY, LineState.OUT_OF_STEP, LineState.STANDBY)
_JOURNAL_TROUBLE: Final = (
    "The journal cannot be written: reads and stops are carried out, what else has an effect is refused and "
    "not sent. GET /alarms tells why, and what to do."
)


class Liveness(AnswerModel):
    """The gateway's process answers."""

    status: Literal["alive"]


JournalState = TypeAliasType("JournalState", Literal["ready", "unavailable"])


class Readiness(AnswerModel):
    """Readiness of the gateway: can requests be carried out, and if not, because of which part?"""

    ready: bool = Field(
        description="True if every line is open and set up, and at least one controller answers on it."
    )
    lines: dict[str, LineState] = Field(
        description="State of each line that the request's key is for; without a good key none is named.",
        json_schema_extra=DETAIL,
    )
    journal: JournalState = Field(
        description="State of the journal; while it is `unavailable`, all that has an effect is refused but "
        "stops.",
        json_schema_extra=DETAIL,
    )
    detail: str = Field(description="The reasons in words, and what to do.")


class Ticket(AnswerModel):
    """A secret that opens one event stream."""

    ticket: str = Field(
        description="The secret, for the query parameter `ticket` of /events, /events/stream or the stream "
        "of a trace."
    )
    expires_in_s: float = Field(description="Seconds for which the ticket is valid, once.")


def ticket_of(text: str) -> Ticket:
    """Tell a ticket."""
    return Ticket(ticket=text, expires_in_s=TICKET_S)


def readiness_of(plant: Plant, is_seen: Callable[[str], bool]) -> Readiness:
    """Tell whether all lines can be used, and the journal; of lines that are seen with their names."""
    ports = plant.ports().values()
    unusable = [port for port in ports if port.state not in _USABLE]
    named = [f"{port.id} is {port.state}" for port in unusable if is_seen(port.id)]
    journal_works = plant.journal is None or plant.journal.trouble is None
    sentences = [f"Not every line can be used{': ' if named else ''}{', '.join(named)}."] if unusable else []
    if not journal_works:
        sentences.append(_JOURNAL_TROUBLE)
    return Readiness(
        ready=not unusable,
        lines={port.id: port.state for port in ports if is_seen(port.id)},
        journal="ready" if journal_works else "unavailable",
        detail=" ".join(sentences) or "All lines and the journal are ready.",
    )


@STREAMS.get("/events/stream", http_only=STREAM, documented=False)
async def stream_events(
    *,
    after: After = None,
    bodies: Bodies = None,
    types: Types = None,
    sample: Sample = None,
    snapshot: Snapshot = False,
) -> None:
    """Send events as they happen; a browser resumes with Last-Event-ID."""


@STREAMS.get("/lines/{line_id}/trace/stream", http_only=STREAM, documented=False)
async def follow_trace(
    line_id: LineId,
    *,
    bodies: TracedBodies = None,
    request_id: TracedRequest = None,
    polls: TracedPolls = True,
    last: Annotated[int, Field(ge=0, le=MAX_TRACE_ENTRIES)] = 0,
) -> None:
    """Send a line's records as they come, after the `last` that there are."""


@HEALTH.get("/livez", Right.OPEN, later=True, http_only=STATUS, result=Liveness)
async def livez() -> None:
    """Answer, as long as the process can."""


@HEALTH.get("/readyz", Right.OPEN, http_only=STATUS, result=Readiness)
async def readyz() -> None:
    """Say whether all lines are open and set up, a device answers on each, and the journal can be written.

    A journal in trouble is no 503: no other gateway could carry out the stops and reads that go on.
    """


@HEALTH.get("/metrics", http_only=FIGURES, documented=False)
async def metrics() -> None:
    """Give all figures to Prometheus."""


# Clients made of the documents know no files.
@RECORDINGS.get("/recordings/{recording_id}/content", any_scope=True, http_only=FILE, documented=False)
async def download_recording(recording_id: str) -> None:
    """Download a recording: a zip, for `motion-gateway export` and `replay`."""


@TICKETS.post("/tickets", Right.VIEW, later=True, any_scope=True, http_only=TICKET, result=Ticket)
async def issue_ticket() -> None:
    """Give a ticket for one event stream, which ends with the session or the key it was given for.

    It is for browsers, whose WebSockets and EventSources send no key.
    """
