"""What only HTTP serves, each with its reason: it stands in the table, and its route is written by hand."""

from typing import Final, NamedTuple

from gateway.core.operation import Rows, Verb
from gateway.core.rights import Right

ROWS: Final = Rows("of HTTP")
CSV: Final = "it is a table as CSV, with its media type; as data it is asked in parts"
STREAM: Final = "it is a stream, which has no end"
STATUS: Final = "its status is the answer, for what watches processes over HTTP"
FIGURES: Final = "it is the text that Prometheus reads"
TICKET: Final = "it is for those who can send no header"
UNIT: Final = "/robots/{robot_id}/units/{unit}"


class OfHttp(NamedTuple):
    """A route that is written by hand."""

    verb: Verb
    path: str
    right: Right
    name: str
    what: str
    why: str


TABLE: Final = (
    OfHttp(
        "GET",
        "/bodies/{body_id}/positions.csv",
        Right.VIEW,
        "download_body_positions",
        "Read stored positions as CSV.",
        CSV,
    ),
    OfHttp(
        "PUT",
        "/bodies/{body_id}/positions.csv",
        Right.SETUP,
        "upload_body_positions",
        "Store positions from CSV.",
        CSV,
    ),
    OfHttp(
        "POST",
        "/bodies/{body_id}/positions.csv",
        Right.SETUP,
        "upload_body_position_csv",
        "Begin to store positions from CSV.",
        CSV,
    ),
    OfHttp(
        "GET",
        f"{UNIT}/positions.csv",
        Right.VIEW,
        "download_positions",
        "Read a unit's stored positions as CSV.",
        CSV,
    ),
    OfHttp(
        "PUT",
        f"{UNIT}/positions.csv",
        Right.SETUP,
        "upload_positions",
        "Store a unit's positions from CSV.",
        CSV,
    ),
    OfHttp(
        "GET",
        "/bodies/{body_id}/moves/{move_id}/samples.csv",
        Right.VIEW,
        "download_samples",
        "Get the samples of a move as CSV.",
        CSV,
    ),
    OfHttp(
        "GET",
        f"{UNIT}/moves/{{move_id}}/samples.csv",
        Right.VIEW,
        "download_robot_samples",
        "Get the samples of a unit's move as CSV.",
        CSV,
    ),
    OfHttp("GET", "/events/stream", Right.VIEW, "stream_events", "Send events as they happen.", STREAM),
    OfHttp(
        "GET",
        "/lines/{line_id}/trace/stream",
        Right.VIEW,
        "follow_trace",
        "Send the line's records as they come.",
        STREAM,
    ),
    OfHttp("GET", "/livez", Right.OPEN, "livez", "Answer, as long as the process can.", STATUS),
    OfHttp("GET", "/readyz", Right.OPEN, "readyz", "Say whether all lines can be used.", STATUS),
    OfHttp("GET", "/metrics", Right.VIEW, "metrics", "Give all figures.", FIGURES),
    OfHttp("POST", "/tickets", Right.VIEW, "issue_ticket", "Give a ticket for one event stream.", TICKET),
)


async def _by_http() -> None:
    """Leave it to HTTP.

    :raises TypeError: it was asked otherwise.
    """
    raise TypeError("HTTP alone serves this")


for it in TABLE:
    ROWS.add(
        it.verb,
        it.path,
        it.right,
        _by_http,
        name=it.name,
        description=it.what,
        any_scope=it.name == "issue_ticket",
        http_only=it.why,
        result=None,
    )
