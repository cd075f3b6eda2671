"""The words of the documentation for its sections, and for the routes of each place."""

from collections.abc import Mapping
from typing import Any, Final

from gateway.door.table import RouteWords, registered

_FIRST: Final = {
    "stops": "Software stops, ahead of everything else. They do not replace a hardware stop.",
    "moves": "Moves of bodies and groups: each has a record, and is followed to its end.",
    "lines": "The lines: their state, their load, the trace of what they carry, and searches for bodies.",
    "events": "What has happened, in order, and as it happens.",
    "alarms": "What stands and needs somebody: what happened, what the motor did, what to do next.",
    "system": "The gateway: who may do what, its weakened defaults, and tickets for WebSockets.",
    "health": "Whether the gateway runs, whether it is ready, and its version.",
}
_MORE: Final = {
    "sessions": "Who has signed in with a browser.",
    "security log": "Who was let in, who was refused, who changed what.",
    "samples": "What was measured during a move, beside what was planned.",
    "jogs": "Moves that last while somebody holds them: without heartbeats they end.",
    "backups": "Everything that a body, a line or a robot keeps, as one text: read, compare, restore.",
    "recordings": "What went over the lines, with all that happened meanwhile, as files.",
    "configuration": "Which lines are served: found at ports, added, and read anew from the file.",
    "audit": "Who has asked for what, and what became of it.",
    "leases": "Who may move what, for a while.",
    "access keys": "Keys of people and programs: made and shown once, listed, revoked.",
}


def _with_registered(own: Mapping[str, str], *, first: bool) -> Mapping[str, str]:
    """Put the sections of families and extensions in their places among the gateway's own."""
    theirs = [
        section for kind in registered() for section in kind.sections if section.is_needed_first is first
    ]
    told: dict[str, str] = {}
    for tag in (*own, ""):
        told |= {section.tag: section.told for section in theirs if section.before == tag}
        told |= {tag: own[tag]} if tag else {}
    return told


CORE: Final = _with_registered(_FIRST, first=True)
"""The sections of what is needed first: to move, to stop, and to see what has happened."""

SECTIONS: Final[Mapping[str, str]] = {**CORE, **_with_registered(_MORE, first=False)}
"""All sections of the documentation, by their tags, in the order in which it shows them."""

_ORDER: Final = tuple(SECTIONS)


def place_of(path: tuple[str, Mapping[str, Any]]) -> tuple[int, str]:
    """Where the documents tell of a path: in the first of the sections of its routes, by its name."""
    name, routes = path
    return min(_ORDER.index(tag) for route in routes.values() for tag in route["tags"]), name


def words_of(path: str) -> RouteWords:
    """The words of a place; one without words of its own has those that are true of all."""
    return next((kind.words[path] for kind in registered() if path in kind.words), RouteWords())
