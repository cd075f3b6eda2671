"""The log of the plant, and its figures: ends of moves and stops, alarms, and what comes and goes.

Lines tell of themselves (`gateway/core/line.py`); refusals are told where they are answered.
"""

import asyncio
import logging
from collections import defaultdict
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, Final, NamedTuple

from gateway.core.events import Event
from gateway.core.load import Histogram
from gateway.core.move_record import MoveStatus
from gateway.core.origin import current

log = logging.getLogger(__name__)

EventData = Mapping[str, Any]


class _Line(NamedTuple):
    level: int
    say: Callable[[str, EventData], str]
    """Writes the sentence for an address and the event's data."""


def _of_move(_: str, move: EventData) -> str:
    error = move["error"] or {}
    place = "" if move["position"] is None else f" at {move['position']}"
    why = f": {error['detail']}" if error else f" ({move['end_cause']})" if move["end_cause"] else ""
    return f"move {move['id']} of {move['body_id']} ({move['kind']}) {move['status']}{place}{why}"


def _of_stop(how: str) -> Callable[[str, EventData], str]:
    return lambda address, report: (
        f"stop of {address} {how}" + (f": {report['detail']}" if report["detail"] else "")
    )


def _of_jog(address: str, jog: EventData) -> str:
    return f"JOG {jog['id']} of axis {jog['axis']} of {address} {jog['state']}"


def _comes(address: str, _: EventData) -> str:
    return f"{address} answers again"


def _goes(address: str, _: EventData) -> str:
    return f"{address} does not answer any more"


def _raised(_: str, alarm: EventData) -> str:
    return f"alarm {alarm['id']} {alarm['cause']}: {alarm['en']['happened']}"


def _reset(_: str, alarm: EventData) -> str:
    return f"alarm {alarm['id']} {alarm['cause']} at {alarm['subject']} is reset by {alarm['reset_by']}"


_ENDS: Final[Mapping[str, int]] = {
    "succeeded": logging.INFO,
    "stopped": logging.INFO,
    "cancelled": logging.INFO,
    "rejected": logging.INFO,
    "failed": logging.WARNING,
    "lost": logging.WARNING,
    "unknown": logging.WARNING,
}
_BOTH: Final = ("body", "robot")
_LINES: Final[Mapping[str, _Line]] = {
    **{f"{kind}.move.{end}": _Line(level, _of_move) for kind in _BOTH for end, level in _ENDS.items()},
    **{f"{kind}.stop.confirmed": _Line(logging.INFO, _of_stop("confirmed")) for kind in _BOTH},
    **{f"{kind}.stop.unconfirmed": _Line(logging.ERROR, _of_stop("not confirmed")) for kind in _BOTH},
    "robot.stop.refused": _Line(logging.WARNING, _of_stop("refused")),
    **{f"robot.jog.{end}": _Line(logging.INFO, _of_jog) for end in ("ended", "lost", "stopped")},
    **{f"{kind}.online": _Line(logging.INFO, _comes) for kind in _BOTH},
    **{f"{kind}.offline": _Line(logging.WARNING, _goes) for kind in _BOTH},
    "alarm.raised": _Line(logging.WARNING, _raised),
    "alarm.reset": _Line(logging.INFO, _reset),
}


def note(event: Event) -> None:
    """Write a line, if the event is worth one."""
    line = _LINES.get(event.type)
    if line is None or not log.isEnabledFor(line.level):
        return
    data, origin = event.data, current()
    address = event.subject.split("/", 2)[-1]
    facts = {
        "event": event.type,
        "subject": event.subject,
        "cursor": event.cursor,
        "caller": origin.caller,
        "request_id": data.get("request_id") or origin.request_id,
        "move_id": data["id"] if ".move." in event.type else data.get("move_id"),
    }
    log.log(line.level, "%s", line.say(address, data), extra={"facts": facts})


OUTCOMES: Final = tuple(status.value for status in MoveStatus if status.final)
STOP_BOUNDS_S: Final = (0.01, 0.025, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0, 10.0, 60.0)
"""Bounds for the time from the request to the standstill that the controller reports, in seconds."""


class Figures:
    """Counts events by the line that they come from."""

    def __init__(self, line_of: Callable[[str], str]) -> None:
        self._line_of = line_of
        """Finds the line of a subject."""
        self.moves: defaultdict[tuple[str, str], int] = defaultdict(int)
        """Number of moves that have ended, by line and outcome."""
        self.stops: defaultdict[str, Histogram] = defaultdict(lambda: Histogram(STOP_BOUNDS_S))
        """Times of stops, by line."""
        self._asked_at: dict[str, float] = {}

    def note(self, event: Event) -> None:
        """Count an event, if it is one that counts."""
        what, news = _meaning(event.type)
        if what == "move" and news in OUTCOMES:
            self.moves[self._line_of(event.subject), news] += 1
        elif what == "stop" and news == "requested":
            self._asked_at.setdefault(event.subject, asyncio.get_running_loop().time())
        elif what == "stop" and news == "confirmed" and event.subject in self._asked_at:
            took_s = asyncio.get_running_loop().time() - self._asked_at.pop(event.subject)
            self.stops[self._line_of(event.subject)].observe(took_s)


@lru_cache(maxsize=256)
def _meaning(type_: str) -> tuple[str, str]:
    """Split an event's type into the kind of its subject and the news."""
    _, what, news, *_ = [*type_.split("."), "", ""]
    return what, news
