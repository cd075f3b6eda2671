"""What has happened at the plant, in one order for everybody, and how a client reads on after a break."""

import asyncio
import re
import secrets
from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal, NamedTuple, Self

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field
from pydantic_core import from_json, to_json

from gateway.core.addresses import canonical_address
from gateway.core.errors import InvalidRequest

RETAINED_EVENTS = 100_000
"""How many of the newest events can be read again."""

MAX_BACKLOG = 1024
"""Events a live subscription may be behind: eight from each of 120 bodies at once are not its fault."""

BATCH = 64
"""Events a reader takes before it lets the rest of the gateway run."""

MAX_PAGE = 1000
"""Events in one page of the list."""

GAP = "stream.gap"
"""Type of the event, made for one client only, that stands for events it can no longer get."""

_SOURCE = "/motion-gateway"
_CURSOR = re.compile("([0-9a-f]{8})-([0-9]{12})")
_ADDRESSED = frozenset({"bodies", "groups", "robots"})
"""What has an address that a filter can name."""
_TYPE = re.compile(r"[a-z0-9_]+(?:\.[a-z0-9_]+)*(?P<any>\.\*)?")


class CloudEvent(BaseModel):
    """An event as clients see it: CloudEvents 1.0 with the extensions sequence, cursor and correlationid."""

    model_config = ConfigDict(frozen=True)

    specversion: Literal["1.0"] = "1.0"
    id: str
    source: str = _SOURCE
    type: str
    subject: str
    """`/lines/LINE`, `/bodies/LINE.3F`, `/groups/LINE.80`, `/robots/ROBOT`, `/robots/ROBOT/units/1`, or
    `/events` for the stream itself."""
    time: AwareDatetime
    datacontenttype: Literal["application/json"] = "application/json"
    sequence: str = Field(pattern="^[0-9]{12}$")
    """Order of events since the gateway's start, without gaps; sorts as text."""
    cursor: str
    """Where reading can go on after this event."""
    correlationid: str | None = Field(None, exclude_if=lambda value: value is None)
    """Id of the move, scan or request it belongs to."""
    data: dict[str, Any]


class Event(NamedTuple):
    """Something that happened, numbered from 1 within its epoch."""

    epoch: str
    number: int
    type: str
    subject: str
    json: str
    """The text that all clients get, written when it happened."""

    @property
    def cursor(self) -> str:
        """Where reading can go on after this event."""
        return _cursor(self.epoch, self.number)

    @property
    def data(self) -> dict[str, Any]:
        """What it tells, read from its text."""
        return dict(from_json(self.json)["data"])


Data = Mapping[str, Any] | BaseModel
"""What an event tells: it is written at once, and may change afterwards."""


class SlowConsumer(Exception):  # the name clients see
    """A subscription has fallen too far behind and has ended; reading can go on after `cursor`."""

    def __init__(self, cursor: str) -> None:
        super().__init__(f"The client reads more slowly than events happen; go on after {cursor}.")
        self.cursor = cursor


@dataclass(frozen=True, slots=True)
class Filter:
    """Which events somebody wants; empty means all."""

    bodies: frozenset[str] = frozenset()
    types: frozenset[str] = frozenset()
    prefixes: tuple[str, ...] = ()

    @classmethod
    def of(cls, bodies: Iterable[str] | None = None, types: Iterable[str] | None = None) -> Self:
        """Read addresses like `3F`, `line.3F` or `r1/units/1`, and types like `line.down` or `body.move.*`.

        :raises InvalidRequest: one of them is neither.
        """
        addresses = frozenset(canonical_address(body) for body in bodies or ())
        exact: set[str] = set()
        prefixes: list[str] = []
        for text in types or ():
            match = _TYPE.fullmatch(text)
            if match is None:
                raise InvalidRequest(
                    f"{text!r} is no type of events.", "Give types such as line.down or body.move.*"
                )
            if match["any"]:
                prefixes.append(text.removesuffix("*"))
            else:
                exact.add(text)
        return cls(addresses, frozenset(exact), tuple(prefixes))

    def wants(self, event: Event) -> bool:
        """Whether the event passes."""
        if (self.types or self.prefixes) and not (
            event.type in self.types or event.type.startswith(self.prefixes)
        ):
            return False
        if not self.bodies:
            return True
        kind, _, address = event.subject.removeprefix("/").partition("/")
        if kind not in _ADDRESSED:
            return False
        # With its line, without it, and the robot that a unit belongs to.
        names = (address, address.rpartition(".")[2], address.partition("/")[0])
        return not self.bodies.isdisjoint(names)


class Subscription(AsyncIterator[Event]):
    """The events that one client wants, from its cursor on: first those it has missed, then each new one.

    It is a place in the hub's ring and keeps no events of its own, so that the change from old to new can
    neither leave out nor repeat one. Iteration ends when the hub is closed, or by `SlowConsumer`.
    """

    def __init__(self, hub: "EventHub", position: int, wanted: Filter, missed_after: str | None) -> None:
        self._hub = hub
        self._position = position
        self._wanted = wanted
        self._missed_after = missed_after
        self._live = False
        self._since_pause = 0
        self._wake: asyncio.Future[None] | None = None

    @property
    def cursor(self) -> str:
        """Where reading can go on: everything up to here was delivered or not wanted."""
        return _cursor(self._hub.epoch, self._position)

    async def __anext__(self) -> Event:
        """Wait for the next event.

        :raises SlowConsumer: more than `MAX_BACKLOG` events have come while the last one was being handled.
        """
        while (event := await self.next_published()) is None:
            if self._hub.closed:
                raise StopAsyncIteration
            self._live = True
            await self._next_publication()
        return event

    async def next_published(self) -> Event | None:
        """Take the next event that has happened already; None when there is none.

        :raises SlowConsumer: as iteration does.
        """
        if self._live and self._hub.last - self._position > MAX_BACKLOG:
            raise SlowConsumer(self.cursor)
        while self._missed_after or self._position < self._hub.last:
            await self._pause_between_batches()
            if self._missed_after or self._position < self._hub.first - 1:
                return self._skip_to_first()
            self._position += 1
            event = self._hub.event(self._position)
            if self._wanted.wants(event):
                return event
        return None

    def wake(self) -> None:
        """Look again at once."""
        if self._wake is not None and not self._wake.done():
            self._wake.set_result(None)

    def offer(self, event: Event) -> bool:
        """Wake up for a new event if it is wanted; called by the hub while the subscription is idle."""
        if self._wake is None or self._wake.done():
            return True
        if not self._wanted.wants(event):
            self._position = event.number
            return False
        self._wake.set_result(None)
        return True

    def _skip_to_first(self) -> Event:
        requested = self._missed_after or self.cursor
        self._missed_after = None
        self._position = self._hub.first - 1
        return self._hub.gap_before(self._position + 1, requested)

    async def _pause_between_batches(self) -> None:
        self._since_pause += 1
        if self._since_pause > BATCH:
            self._since_pause = 1
            await asyncio.sleep(0)

    async def _next_publication(self) -> None:
        self._wake = asyncio.get_running_loop().create_future()
        self._hub.add_idle(self)
        try:
            await self._wake
        finally:
            self._hub.remove_idle(self)
            self._since_pause = 0


@dataclass(frozen=True, slots=True)
class Page:
    """Events from the list, and the cursor after which the next page begins."""

    events: list[Event]
    cursor: str


class EventHub:
    """Numbers events, keeps the newest and hands them out. Not for use from other threads.

    Without a journal an epoch is one life of the gateway: after a restart numbers begin anew, and cursors of
    the old epoch are answered with a gap. With one, numbers go on, and so do cursors.
    """

    def __init__(
        self,
        epoch: str | None = None,
        capacity: int = RETAINED_EVENTS,
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        self.epoch = epoch or secrets.token_hex(4)
        self.last = 0
        """Number of the newest event; 0 before the first."""
        self.closed = False
        self._capacity = capacity
        self._clock = clock
        self._ring: list[tuple[str, str, str]] = []
        """Type, subject and text: tuples of texts are nothing to the garbage collector, which would hold the
        loop for 100 ms to look through so many objects (decision 9)."""
        self._ring_begins_after = 0
        """Number of the event before the one in the first place of the ring."""
        self._earlier: Mapping[str, int] = {}
        """Epochs that were before, each with the number of its last event."""
        self._idle: list[Subscription] = []
        self.on_published: Callable[[Event], object] = lambda _: None

    def resume(
        self, epoch: str, earlier: Mapping[str, int], last: int, events: Iterable[tuple[str, str, str]]
    ) -> None:
        """Go on after the last event of an earlier life; `events` are the newest up to that."""
        self.epoch, self._earlier, self.last = epoch, earlier, last
        self._ring = list(events)[-self._capacity :]
        self._ring_begins_after = last - len(self._ring)

    @property
    def first(self) -> int:
        """Number of the oldest event that can still be read."""
        return self.last - len(self._ring) + 1

    @property
    def cursor(self) -> str:
        """Where somebody begins who wants everything from now on."""
        return _cursor(self.epoch, self.last)

    def publish(self, type_: str, subject: str, data: Data, correlation: str | None = None) -> Event:
        """Number an event and keep it; it can be read as soon as this returns."""
        event = self._event(self.last + 1, type_, subject, data, correlation)
        record = (type_, subject, event.json)
        if len(self._ring) < self._capacity:
            self._ring.append(record)
        else:
            self._ring[self._place_of(self.last + 1)] = record
        self.last += 1
        self.on_published(event)
        if self._idle:
            self._idle = [subscription for subscription in self._idle if not subscription.offer(event)]
        return event

    def close(self) -> None:
        """End all subscriptions once they have read what there is: the gateway is shutting down."""
        self.closed = True
        for subscription in self._idle:
            subscription.wake()

    def subscribe(
        self,
        after: str | None = None,
        bodies: Iterable[str] | None = None,
        types: Iterable[str] | None = None,
    ) -> Subscription:
        """Begin after a cursor, or now; a cursor that cannot be continued is answered with a `GAP` first.

        :raises InvalidRequest: the cursor or a filter is malformed.
        """
        return self._read(self.cursor if after is None else after, Filter.of(bodies, types))

    async def since(
        self,
        after: str | None = None,
        bodies: Iterable[str] | None = None,
        types: Iterable[str] | None = None,
        limit: int = MAX_PAGE,
    ) -> Page:
        """List what has happened after a cursor, or from the oldest event on; a gap is an event here, too.

        :raises InvalidRequest: the cursor or a filter is malformed.
        """
        reader = self._read(
            _cursor(self.epoch, self.first - 1) if after is None else after, Filter.of(bodies, types)
        )
        events: list[Event] = []
        while len(events) < min(limit, MAX_PAGE) and (event := await reader.next_published()):
            events.append(event)
        return Page(events, reader.cursor)

    def event(self, number: int) -> Event:
        """Give a retained event, from `first` to `last`."""
        return Event(self.epoch, number, *self._ring[self._place_of(number)])

    def _place_of(self, number: int) -> int:
        return (number - 1 - self._ring_begins_after) % self._capacity

    def gap_before(self, number: int, requested: str) -> Event:
        """Make the event that stands for those between a requested cursor and an event number."""
        first_available = _cursor(self.epoch, number)
        data = {"requested": requested, "first_available": first_available}
        return self._event(number - 1, GAP, "/events", data)

    def _event(
        self, number: int, type_: str, subject: str, data: Data, correlation: str | None = None
    ) -> Event:
        """Write an event as `CloudEvent` has it; the model itself would take three times as long."""
        cursor = _cursor(self.epoch, number)
        told = {
            "specversion": "1.0",
            "id": f"{cursor}-gap" if type_ == GAP else cursor,
            "source": _SOURCE,
            "type": type_,
            "subject": subject,
            "time": self._clock(),
            "datacontenttype": "application/json",
            "sequence": f"{number:012d}",
            "cursor": cursor,
            **({} if correlation is None else {"correlationid": correlation}),
            "data": data,
        }
        return Event(self.epoch, number, type_, subject, to_json(told, inf_nan_mode="null").decode())

    def add_idle(self, subscription: Subscription) -> None:
        """Offer new events to a subscription that has read all."""
        self._idle.append(subscription)

    def remove_idle(self, subscription: Subscription) -> None:
        """Offer it no more."""
        if subscription in self._idle:
            self._idle.remove(subscription)

    def _read(self, after: str, wanted: Filter) -> Subscription:
        match = _CURSOR.fullmatch(after)
        if match is None:
            raise InvalidRequest(
                f"{after!r} is no cursor.", f"Give the cursor of an event, such as {self.cursor}."
            )
        epoch, number = match[1], int(match[2])
        if epoch == self.epoch and number <= self.last:
            return Subscription(self, number, wanted, None)
        if epoch in self._earlier:  # it may have seen more of it than the journal has
            return Subscription(self, min(number, self._earlier[epoch]), wanted, None)
        return Subscription(self, self.first - 1, wanted, after)


def _cursor(epoch: str, number: int) -> str:
    return f"{epoch}-{number:012d}"
