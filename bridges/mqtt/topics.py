"""Topics below the root, and what is published under them."""

import json
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any, Final
from urllib.parse import unquote

STATUS: Final = "status"
COMMANDS: Final = "cmd"
STOP: Final = "/stop"
"""End of the topic of each stop."""
STATES: Final = ("+/+/state", "+/+/units/+/state", "alarms/+")
"""Filters of all that is retained of documents."""
OF_ROBOT: Final = ("online", "moving", "power_cycled")
"""Members of a robot's document that the documents of its units lack."""
SHOWN: Final = 200
"""Characters of what others have sent that a log gets."""

Document = Mapping[str, Any]


def written(content: object) -> bytes:
    """Write JSON as the gateway does.

    :raises ValueError: it holds a number that is none, or a half of a character.
    """
    return json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()


def now() -> str:
    """Tell the time as the gateway does."""
    return datetime.now(UTC).isoformat().replace("+00:00", "Z")


def topic_of(path: str) -> str:
    """Give the topic of a document: `/bodies/line1.3F` is told at `bodies/line1.3F/state`."""
    place = unquote(path).removeprefix("/")
    return place if place.startswith("alarms/") else f"{place}/state"


def topic_of_event(event: Document) -> str:
    """Give the topic of an event: `events/bodies/line1.3F/body.move.succeeded`."""
    return f"events{event['subject']}/{event['type']}"


def state_of(path: str, documents: Mapping[str, Document]) -> dict[str, Any]:
    """Give what is told of a document: as GET has it, with the time, and the age of a position."""
    document = documents[path]
    state = {**document}
    if path.startswith("/alarms/"):
        return state
    robot = documents.get(path.partition("/units/")[0]) if "/units/" in path else None
    if robot is not None:
        state |= {name: robot.get(name) for name in OF_ROBOT}
    if path.startswith("/bodies/"):
        state["position_age_s"] = _position_age_s(document)
    state["time"] = now()
    return state


def _position_age_s(body: Document) -> float | None:
    """Count by the gateway's clock alone: the age of its last answer, and how much older the position is."""
    read_at, heard_at, age_s = (
        body.get(member) for member in ("position_read_at", "last_heard_at", "known_age_s")
    )
    if read_at is None or heard_at is None or age_s is None:
        return None
    older_s = (datetime.fromisoformat(heard_at) - datetime.fromisoformat(read_at)).total_seconds()
    return round(float(age_s) + max(older_s, 0.0), 3)
