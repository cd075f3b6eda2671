"""Rows that HTTP alone serves, each with its reason: `api` writes their routes by hand."""

from collections.abc import Callable
from typing import Any, Final, Literal

from pydantic import BaseModel, Field

from gateway.access.grants import TICKET_S
from gateway.core.line_state import LineState
from gateway.core.operation import Rows, Verb
from gateway.core.rights import Right
from gateway.plant import Plant

STREAMS: Final = Rows("streams")
HEALTH: Final = Rows("health")
TICKETS: Final = Rows("system")
RECORDINGS: Final = Rows("recordings")
STREAM: Final = "it is a stream, which has no end"
TRACE: Final = "/lines/{line_id}/trace/stream"
CONTENT: Final = "/recordings/{recording_id}/content"
FILE: Final = "it is a file, which is sent as it is read"
FIGURES: Final = "it is the text that Prometheus reads"
TICKET: Final = "it is for those who can send no header"
STATUS: Final = "its status is the answer, for what watches processes over HTTP"

_USABLE: Final = (LineState.READY, LineState.OUT_OF_STEP, LineState.STANDBY)
_JOURNAL_TROUBLE: Final = (
    "The journal cannot be written: reads and stops are carried out, what else has an effect is refused and "
    "not sent. GET /alarms tells why, and what to do."
)


class Liveness(BaseModel):
    """The gateway's process answers."""

    status: Literal["alive"]


class Readiness(BaseModel):
    """Readiness of the gateway: can requests be carried out, and if not, because of which part?"""

    ready: bool = Field(
        description="True if every line is open and set up, and at least one controller answers on it."
    )
    lines: dict[str, LineState] = Field(
        description="State of each line that the request's key is for; without a good key none is named."
    )
    journal: Literal["ready", "unavailable"] = Field(
        description="State of the journal; while it is `unavailable`, all that has an effect is refused but "
        "stops."
    )
    detail: str = Field(description="The reasons in words, and what to do.")


class Ticket(BaseModel):
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


_TABLE: Final[tuple[tuple[Rows, Verb, str, Right, str, str, str, Any], ...]] = (
    (STREAMS, "GET", "/events/stream", Right.VIEW, "stream_events", "Send events.", STREAM, None),
    (STREAMS, "GET", TRACE, Right.VIEW, "follow_trace", "Send a line's records.", STREAM, None),
    (HEALTH, "GET", "/livez", Right.OPEN, "livez", "Answer.", STATUS, Liveness),
    (HEALTH, "GET", "/readyz", Right.OPEN, "readyz", "Say if all can be used.", STATUS, Readiness),
    (HEALTH, "GET", "/metrics", Right.VIEW, "metrics", "Give all figures.", FIGURES, None),
    (RECORDINGS, "GET", CONTENT, Right.VIEW, "download_recording", "Download a recording.", FILE, None),
    (TICKETS, "POST", "/tickets", Right.VIEW, "issue_ticket", "Give a ticket.", TICKET, Ticket),
)


async def _by_http() -> None:
    """Leave it to HTTP.

    :raises TypeError: it was asked otherwise.
    """
    raise TypeError("HTTP alone serves this")


for section, verb, path, right, name, what, why, result in _TABLE:
    section.add(
        *(verb, path, right, _by_http),
        name=name,
        description=what,
        any_scope=section in (RECORDINGS, TICKETS),
        http_only=why,
        result=result,
    )
