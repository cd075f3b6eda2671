"""Values as they are now: the newest of each, for watchers, as often as they ask for it.

They are no events: they have no place in their order and are not kept. A new one takes the place of the last.
"""

import asyncio
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from contextlib import AbstractContextManager
from datetime import datetime, timedelta
from typing import NamedTuple, Protocol

from pydantic import BaseModel
from pydantic_core import to_json

GATHER, LONGEST_GATHER_S = 0.25, 0.05
"""Share of the pause between two deliveries in which values gather to one write, and its limit."""


class LiveWish(Hashable, Protocol):
    """The live values that a client watches."""

    def passes(self, type_: str, subject: str) -> bool:
        """Say whether values of a type, about a subject, are wanted."""


class LiveValue(NamedTuple):
    """The newest value of one target."""

    number: int
    """Counts all readings."""
    type: str
    subject: str
    json: str
    """The text that all clients get, but for its end: the cursor of the client's place among the events."""


class Live:
    """The newest readings, and who watches them."""

    def __init__(self, epoch: str, source: str, clock: Callable[[], datetime]) -> None:
        self.last = 0
        """Number of the newest reading."""
        self.demand = asyncio.Event()
        """Event that is set, and replaced, when a client begins or ceases to watch."""
        self._epoch, self._source, self._clock = epoch, source, clock
        self._readings: OrderedDict[tuple[str, str], LiveValue] = OrderedDict()
        self._audiences: dict[float, _Audience] = {}
        self._rates: dict[tuple[str, str], float] = {}

    def put(self, type_: str, subject: str, data: BaseModel, at: float | None = None) -> None:
        """Tell a value that was read at time `at` of the event loop, or now; drop it without a watcher."""
        if not self.rate(type_, subject):
            return
        age_s = 0.0 if at is None else asyncio.get_running_loop().time() - at
        self.last += 1
        told = {
            "specversion": "1.0",
            "id": f"{self._epoch}-live-{self.last:012d}",
            "source": self._source,
            "type": type_,
            "subject": subject,
            "time": self._clock() - timedelta(seconds=age_s),
            "datacontenttype": "application/json",
            "data": data,
        }
        text = to_json(told, inf_nan_mode="null").decode().removesuffix("}")
        self._readings[type_, subject] = LiveValue(self.last, type_, subject, text)
        self._readings.move_to_end((type_, subject))
        for audience in self._audiences.values():
            audience.news()

    def newer(self, than: int, wanted: LiveWish) -> list[LiveValue]:
        """The readings after a number, the oldest first."""
        newest: Iterator[LiveValue] = reversed(self._readings.values())
        found = []
        for reading in newest:
            if reading.number <= than:
                break
            if wanted.passes(reading.type, reading.subject):
                found.append(reading)
        return found[::-1]

    def rate(self, type_: str, subject: str) -> float:
        """Highest rate in Hz at which a watcher wants a value; 0 without a watcher."""
        if (rate := self._rates.get((type_, subject))) is None:
            rate = max(
                (audience.hz for audience in self._audiences.values() if audience.wants(type_, subject)),
                default=0.0,
            )
            self._rates[type_, subject] = rate
        return rate

    # who watches

    def join(self, watch: "Watch") -> None:
        """Begin to watch."""
        audience = self._audiences.setdefault(watch.hz, _Audience(watch.hz))
        audience.members.add(watch)
        self.demand_changes()

    def leave(self, watch: "Watch") -> None:
        """Cease to watch; values without a watcher are forgotten."""
        audience = self._audiences[watch.hz]
        audience.members.discard(watch)
        if not audience.members:
            audience.close()
            del self._audiences[watch.hz]
        self.demand_changes()
        for key in [key for key in self._readings if not self.rate(*key)]:
            del self._readings[key]

    def demand_changes(self, _part: object = None) -> None:
        """Note that other values are wanted than before."""
        self._rates.clear()
        self.demand.set()
        self.demand = asyncio.Event()


class Watch(AbstractContextManager["Watch"]):
    """The newest readings that one client wants, and has got; it watches within the context."""

    def __init__(self, live: Live, wanted: LiveWish, hz: float, wake: Callable[[], None]) -> None:
        self.wanted, self.hz, self.wake = wanted, hz, wake
        self.due = False
        """True if there may be readings for it now."""
        self._has = live.last
        self._live = live

    def __enter__(self) -> "Watch":
        self._live.join(self)
        return self

    def __exit__(self, *_: object) -> None:
        self._live.leave(self)

    def take(self) -> int:
        """Take the readings that there are; the number of the last one it had before."""
        before, self._has, self.due = self._has, self._live.last, False
        return before


class _Audience:
    """Watchers with one rate, which are woken together, no more often than that."""

    def __init__(self, hz: float) -> None:
        self.hz = hz
        self.members: set[Watch] = set()
        self._next_at = 0.0
        self._timer: asyncio.TimerHandle | None = None

    def wants(self, type_: str, subject: str) -> bool:
        """Say whether a member wants the value."""
        return any(wanted.passes(type_, subject) for wanted in {member.wanted for member in self.members})

    def news(self) -> None:
        """Note that there is a new reading."""
        if self._timer is None:
            loop = asyncio.get_running_loop()
            gathered_at = loop.time() + min(GATHER / self.hz, LONGEST_GATHER_S)
            self._timer = loop.call_at(max(gathered_at, self._next_at), self._wake)

    def close(self) -> None:
        """Cancel the timer: no member is left."""
        if self._timer is not None:
            self._timer.cancel()

    def _wake(self) -> None:
        self._timer, pause_s = None, 1 / self.hz
        self._next_at = max(self._next_at, asyncio.get_running_loop().time() - GATHER * pause_s) + pause_s
        for member in self.members:
            member.due = True
            member.wake()
