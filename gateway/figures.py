"""Counters of a plant beside those of its lines: ends of moves, and the time of stops."""

import asyncio
from collections import defaultdict
from collections.abc import Callable
from functools import lru_cache
from typing import Final

from gateway.core.events import Event
from gateway.core.load import Histogram
from gateway.core.move_record import MoveStatus

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
