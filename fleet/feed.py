"""The newest events of all gateways in the order in which they came, and how a client reads on after a break.

It is a copy of what the plant's stream has: filled again after a start, and never the truth about anything.
"""

import asyncio
import re
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from json import dumps
from typing import Final, NamedTuple

from fleet.addresses import path_outward
from fleet.cursors import epoch_of, number_of, written
from gateway.core.events import GAP

RETAINED: Final = 100_000
"""Events that can be read again."""
BATCH: Final = 64
MAX_BACKLOG: Final = 4096
"""Events that a client may be behind that has read all before."""
_ABOUT: Final = re.compile(r'"type":"([^"]*)","subject":"([^"]*)"')


class PlantEvent(NamedTuple):
    """An event of a gateway."""

    gateway: str
    id: str
    cursor: str
    type: str
    subject: str
    """The subject, with the gateway's name in its address."""
    json: str


Wanted = Callable[[PlantEvent], bool]


class SlowClient(Exception):
    """A client has fallen too far behind; it can go on after `cursor`."""

    def __init__(self, cursor: str) -> None:
        super().__init__(f"The client reads more slowly than events happen; go on after {cursor}.")
        self.cursor = cursor


def event_of(gateway: str, id_: str, cursor: str, text: str) -> PlantEvent:
    """Read an event as its gateway has written it, and name the gateway in it.

    :raises ValueError: it is no event.
    """
    match = _ABOUT.search(text)
    if match is None or not text.startswith("{"):
        raise ValueError(f"{text[:80]!r} is no event")
    subject = path_outward(gateway, match[2])
    told = f"{text[1 : match.start(2)]}{subject}{text[match.end(2) :]}"
    return PlantEvent(gateway, id_, cursor, match[1], subject, f'{{"gateway":"{gateway}",{told}')


class Feed:
    """Keeps the newest events. Not for use from other threads."""

    def __init__(self, capacity: int = RETAINED) -> None:
        self._events: deque[tuple[str, ...]] = deque()
        """Plain tuples of texts are nothing to the garbage collector: events of a class took it 40 ms."""
        self._capacity = capacity
        self.first = 1
        """The place of the oldest event; places are valid in this process alone and are in no answer."""
        self.holes = 0
        """Number of gaps in the events of the gateways."""
        self._places: dict[str, dict[str, int]] = {}
        """Places of ids and cursors, by gateway."""
        self.newest: dict[str, str] = {}
        """The last cursor of each gateway."""
        self._waiting: set[asyncio.Future[None]] = set()
        self.closed = False

    @property
    def last(self) -> int:
        """The place of the newest event."""
        return self.first + len(self._events) - 1

    def __getitem__(self, place: int) -> PlantEvent:
        """Give the event at a place from `first` to `last`."""
        return PlantEvent._make(self._events[place - self.first])

    def add(self, event: PlantEvent) -> bool:
        """Keep an event behind all others; False for one that is there already."""
        places = self._places.setdefault(event.gateway, {})
        if event.id in places:
            return False
        before = self.newest.get(event.gateway)
        if before is not None and event.type != GAP and _is_hole(before, event.cursor):
            self.holes += 1
            self._append(places, gap_of(event.gateway, before, event.cursor))
        self._append(places, event)
        self.news()
        return True

    def _append(self, places: dict[str, int], event: PlantEvent) -> None:
        self._events.append(tuple(event))
        places[event.id] = self.last
        places.setdefault(event.cursor, self.last)
        self.newest[event.gateway] = event.cursor
        while len(self._events) > self._capacity:
            self._forget_oldest()

    def _forget_oldest(self) -> None:
        old = PlantEvent._make(self._events.popleft())
        places = self._places[old.gateway]
        for key in (old.id, old.cursor):
            if places.get(key) == self.first:
                del places[key]
        self.first += 1

    def news(self) -> None:
        """Wake all who wait."""
        waiting, self._waiting = self._waiting, set()
        for future in waiting:
            if not future.done():
                future.set_result(None)

    def close(self) -> None:
        """End all readers: the process is shutting down."""
        self.closed = True
        self.news()

    async def wait(self) -> None:
        """Wait until something has come."""
        turn = asyncio.get_running_loop().create_future()
        self._waiting.add(turn)
        try:
            await turn
        finally:
            self._waiting.discard(turn)

    def reader(self, after: Mapping[str, str] | None, wanted: Wanted) -> "Reader":
        """Begin after a cursor; without one, now."""
        return Reader(self, dict(self.newest) if after is None else dict(after), wanted)

    def begin(self, after: Mapping[str, str]) -> "tuple[int, dict[str, int], list[PlantEvent]]":
        """Find the place to begin at, up to where each gateway was read, and gaps that are to be told."""
        read: dict[str, int] = {}
        gaps = []
        for gateway, newest in self.newest.items():
            cursor = after.get(gateway)
            places = self._places[gateway]
            if cursor is None:
                continue
            if cursor in places:
                read[gateway] = places[cursor]
            elif epoch_of(cursor) == epoch_of(newest) and number_of(cursor) > number_of(newest):
                read[gateway] = self.last  # another process of the plant was ahead
            else:
                kept = map(PlantEvent._make, self._events)
                oldest = next((event for event in kept if event.gateway == gateway), None)
                if oldest is not None and _is_hole(cursor, oldest.cursor):
                    gaps.append(gap_of(gateway, cursor, oldest.cursor))
        behind = [read.get(gateway, self.first - 1) for gateway in self.newest]
        return min(behind, default=self.last), read, gaps


def _is_hole(before: str, after: str) -> bool:
    """Tell if events are missing between two cursors of a gateway; another epoch says nothing of that."""
    return epoch_of(before) == epoch_of(after) and number_of(after) != number_of(before) + 1


def gap_of(gateway: str, requested: str, first_available: str) -> PlantEvent:
    """Make the event that stands for those of a gateway that cannot be had."""
    cursor = f"{epoch_of(first_available)}-{max(number_of(first_available) - 1, 0):012d}"
    told = {
        "gateway": gateway,
        "specversion": "1.0",
        "id": f"{cursor}-gap",
        "source": "/motion-gateway",
        "type": GAP,
        "subject": "/events",
        "time": datetime.now(UTC).isoformat(),
        "datacontenttype": "application/json",
        "sequence": cursor.partition("-")[2],
        "cursor": cursor,
        "data": {"requested": requested, "first_available": first_available},
    }
    return PlantEvent(gateway, f"{cursor}-gap", cursor, GAP, "/events", dumps(told, separators=(",", ":")))


class Reader:
    """A client's place in the feed; it has no events of its own."""

    def __init__(self, feed: Feed, after: dict[str, str], wanted: Wanted) -> None:
        self._feed, self._wanted = feed, wanted
        self._after = after
        self._place, self._read, self._gaps = feed.begin(after)
        self._in_time = False

    @property
    def cursor(self) -> str:
        """Where reading can go on."""
        return written(self._after)

    def take(self, most: int = BATCH) -> list[PlantEvent]:
        """Take the next events that there are.

        :raises SlowClient: it had read all once, and is too far behind now.
        """
        if self._gaps:
            gaps, self._gaps = self._gaps, []
            return self._passed(gaps)
        feed = self._feed
        behind = feed.last - self._place
        if self._place < feed.first - 1 or (self._in_time and behind > MAX_BACKLOG):
            raise SlowClient(self.cursor)
        taken: list[PlantEvent] = []
        while self._place < feed.last and len(taken) < most:
            self._place += 1
            event = feed[self._place]
            if self._place > self._read.get(event.gateway, 0):
                taken += self._passed([event])
        self._in_time = self._in_time or self._place == feed.last
        return taken

    def _passed(self, events: Sequence[PlantEvent]) -> list[PlantEvent]:
        for event in events:
            self._after[event.gateway] = event.cursor
        return [event for event in events if self._wanted(event)]

    @property
    def is_over(self) -> bool:
        """True if nothing more will come."""
        return self._feed.closed and self._place >= self._feed.last

    async def next(self) -> list[PlantEvent]:
        """Wait for the next events; none when the feed is closed.

        :raises SlowClient: as of `take`.
        """
        while not (events := self.take()):
            if self.is_over:
                return []
            if self._place >= self._feed.last:
                await self._feed.wait()
            else:
                await asyncio.sleep(0)
        return events
