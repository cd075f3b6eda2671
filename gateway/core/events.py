"""The events of the plant, in one order for all clients, and how a client reads on after a break."""

import asyncio
import re
import secrets
import zlib
from collections import OrderedDict, deque
from collections.abc import AsyncIterator, Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import lru_cache, partial
from time import perf_counter
from typing import Any, Literal, NamedTuple, Protocol, Self

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field
from pydantic_core import from_json, to_json

from gateway.core.addresses import canonical_address
from gateway.core.errors import InvalidRequest
from gateway.core.live import Live, Watch
from gateway.core.supervisor import FaultsTo, Observers, do_each
from gateway.core.times import happens

RETAINED_EVENTS = 125_000
"""Newest events that can be read again."""

MAX_BACKLOG = 1024
"""Events a live subscription may be behind: eight from each of 120 bodies at once are not its fault."""

BATCH = 64
"""Events a reader looks at before it lets the rest of the gateway run."""

SHARED_BATCHES = 16
"""Batches that are kept for the next client at the same place with the same filter."""

MAX_PAGE = 1000
"""Events in one page of the list."""

SLOWEST_HZ, FASTEST_HZ = 0.1, 50.0
"""Lowest and highest rate at which a client may ask for live values, in Hz."""

VALUES_WITHIN_S = 1.0
"""The list waits for live values no longer."""

GAP = "stream.gap"
"""Type of the event, made for one client only, that stands for events it can no longer get."""

SNAPSHOT = "stream.snapshot"
"""Type of the event that follows a gap, made for the same client."""

BLOCK = 64
"""Events that are packed together: it takes 0.2 ms, and reading one of them again 0.1 ms."""
LEVEL = 2
UNPACKED = 8
"""Blocks that are kept as they were read."""

SLICE = 128
"""Turns that follow one another before the loop has one."""
SLICE_S = 0.002
"""Turns that take longer end a slice."""
PAUSE = 3
"""Ratio of a pause to the slice before it: turns take a quarter of the time at most."""
LONGEST_PAUSE_S = 0.1

Turn = Callable[[], None]

_SOURCE = "/motion-gateway"
_MADE_FOR_ONE = {GAP: "-gap", SNAPSHOT: "-snapshot"}
"""Ends of the ids of events that have no number of their own."""
_CURSOR = re.compile("([0-9a-f]{8})-([0-9]{12})")
_NOT_ADDRESSED = frozenset({"events", "gateway", "lines"})
"""Subjects without an address that a filter can name."""
_TYPE = re.compile(r"[a-z0-9_]+(?:\.[a-z0-9_]+)*(?P<any>\.\*)?")


class CloudEvent(BaseModel):
    """An event as clients see it: CloudEvents 1.0 with the extensions sequence, cursor and correlationid."""

    model_config = ConfigDict(frozen=True, defer_build=True)

    specversion: Literal["1.0"] = "1.0"
    id: str
    source: str = _SOURCE
    type: str
    subject: str
    """`/lines/LINE`, `/bodies/LINE.3F`, `/groups/LINE.80`, `/robots/ROBOT`, `/robots/ROBOT/units/1`,
    or `/events` for the stream itself."""
    time: AwareDatetime
    datacontenttype: Literal["application/json"] = "application/json"
    sequence: str = Field(pattern="^[0-9]{12}$")
    """Order of events since the gateway's start, without gaps; sorts as text."""
    cursor: str
    """Cursor to go on reading after this event."""
    correlationid: str | None = Field(None, exclude_if=lambda value: value is None)
    """Id of the move, scan or request it belongs to."""
    data: dict[str, Any]


class Telemetry(BaseModel):
    """A value as it was read: a CloudEvent 1.0 that is not kept, and so has no sequence."""

    model_config = ConfigDict(frozen=True, defer_build=True)

    specversion: Literal["1.0"] = "1.0"
    id: str
    source: str = _SOURCE
    type: str
    subject: str
    """`/bodies/LINE.3F` or `/robots/ROBOT/units/1`."""
    time: AwareDatetime
    """Time of the controller's answer."""
    datacontenttype: Literal["application/json"] = "application/json"
    data: dict[str, Any]
    cursor: str
    """Cursor to go on reading events: that of the last event before it."""


class Event(NamedTuple):
    """An event, numbered from 1 within its epoch."""

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
        """The event's data, read from its text."""
        return dict(from_json(self.json)["data"])


Data = Mapping[str, Any] | BaseModel
"""Data of an event: it is written at once, and may change afterwards."""


class SlowConsumer(Exception):  # the name clients see
    """A subscription has fallen too far behind and has ended; reading can go on after `cursor`."""

    def __init__(self, cursor: str) -> None:
        super().__init__(f"The client reads more slowly than events happen; go on after {cursor}.")
        self.cursor = cursor


class Filter(NamedTuple):
    """The events that a client wants; empty means all."""

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
        """Say whether the event passes."""
        return self.passes(event.type, event.subject)

    def passes(self, type_: str, subject: str) -> bool:
        """Say whether events of a type, about a subject, pass."""
        if (self.types or self.prefixes) and not (type_ in self.types or type_.startswith(self.prefixes)):
            return False
        kind, _, address = subject.removeprefix("/").partition("/")
        return not self.bodies or (kind not in _NOT_ADDRESSED and self.wants_address(address))

    def wants_address(self, address: str) -> bool:
        """Say whether events about this whole address pass."""
        # With its line, without it, and the robot that a unit belongs to.
        names = (address, address.rpartition(".")[2], address.partition("/")[0])
        return not self.bodies or not self.bodies.isdisjoint(names)


class Batch:
    """Events that follow one another, and what is written of them: once for all clients that get them."""

    __slots__ = ("_written", "events")

    def __init__(self, events: Sequence[Event]) -> None:
        self.events = events
        self._written: dict[Writer, bytes] = {}

    def written(self, write: "Writer") -> bytes:
        """Give the events as a client gets them."""
        if (text := self._written.get(write)) is None:
            text = self._written[write] = write(self.events)
        return text


Writer = Callable[[Sequence[Event]], bytes]


class EventSink(Protocol):
    """Where the events of one client go."""

    takes: bool
    """True while it takes more."""
    on_room: Callable[[], None]
    """Called when it takes more again."""
    writer: Writer
    """Writer for the text that the client reads."""

    @property
    def write(self) -> Callable[[bytes], None]:
        """Takes a batch as it was written."""


class Subscription(AsyncIterator[Event]):
    """The events that one client wants, from its cursor on: first those it has missed, then each new one.

    It is a place in the hub's ring and keeps no events of its own, so that the change from old to new can
    neither leave out nor repeat one, and a client that does not read costs nothing. It ends when the hub is
    closed, or by `SlowConsumer`.

    With a `sample` it gets live values, too, at most `sample` times a second, once it has read all events:
    the newest of each, without those that it was too slow for. They are read while it is `watching`.
    """

    def __init__(
        self,
        hub: "EventHub",
        position: int,
        wanted: Filter,
        missed_after: str | None,
        sample: float | None = None,
        *,
        snapshot: bool = False,
    ) -> None:
        self._hub = hub
        self._position = position
        self._wanted = wanted
        self._missed_after = missed_after
        self._snapshot_due = snapshot
        """True while it still has to begin with a snapshot."""
        self._watch = (
            None if sample is None else Watch(hub.live, wanted, sample, partial(hub.turns.wake, self))
        )
        self._in_time: int | None = None
        """The newest event when news last found it waiting; None while it reads what it has missed."""
        self._waits = False
        self._snapshot: Event | None = None
        """Snapshot after a gap, which has no number to go on from."""

    @property
    def cursor(self) -> str:
        """Where reading can go on: everything up to here was delivered or not wanted."""
        return _cursor(self._hub.epoch, self._position)

    async def __anext__(self) -> Event:
        """Wait for the next event.

        :raises SlowConsumer: as `next_batch` does.
        """
        if self._snapshot is not None:
            event, self._snapshot = self._snapshot, None
            return event
        batch = await self.next_batch()
        if batch is None:
            raise StopAsyncIteration
        event, *rest = batch.events
        self._position = event.number
        self._snapshot = next((event for event in rest if event.type == SNAPSHOT), None)
        return event

    def watching(self) -> AbstractContextManager[object]:
        """Have live values read within the context, where it was asked for them."""
        return nullcontext() if self._watch is None else self._watch

    async def next_batch(self) -> Batch | None:
        """Wait for the next events; None when the hub is closed, and there are no more.

        :raises SlowConsumer: more than `MAX_BACKLOG` events have come while the last ones were being handled.
        """
        while True:
            turn = asyncio.get_running_loop().create_future()
            self._in_turn(partial(_wake, turn))
            try:
                await turn
            finally:
                self._hub.turns.forget(self)
            if (batch := self._take()).events:
                return batch
            if self._hub.closed and self._has_read_all:
                return None

    async def deliver(self, outlet: EventSink) -> None:
        """Write events to an outlet until the hub is closed.

        :raises SlowConsumer: it has taken nothing while more than `MAX_BACKLOG` events have come.
        """
        end: asyncio.Future[SlowConsumer | None] = asyncio.get_running_loop().create_future()
        turn = partial(self._deliver, outlet, end)
        outlet.on_room = partial(self._in_turn, turn)
        self._in_turn(turn)
        try:
            with self.watching():
                slow = await end
        finally:
            outlet.on_room = _nothing
            self._hub.turns.forget(self)
        if slow is not None:
            raise slow

    def _deliver(self, outlet: EventSink, end: "asyncio.Future[SlowConsumer | None]") -> None:
        """Have a turn of a delivery: no task is woken for each event of each client."""
        if not outlet.takes or end.done():
            return
        with FaultsTo(end.set_exception):  # the client is told, and can read on after its last event
            try:
                self._write_next(outlet, end)
            except SlowConsumer as slow:
                end.set_result(slow)

    def _write_next(self, outlet: EventSink, end: "asyncio.Future[SlowConsumer | None]") -> None:
        batch = self._take()
        if batch.events:
            outlet.write(batch.written(outlet.writer))
        elif self._hub.closed and self._has_read_all:
            end.set_result(None)
            return
        if outlet.takes:
            outlet.on_room()

    @property
    def _has_read_all(self) -> bool:
        owed = self._snapshot_due or self._missed_after is not None
        return self._position == self._hub.last and not owed

    def _in_turn(self, turn: Turn) -> None:
        """Have a turn: at news, or soon where there is something to be read, or nothing more to come."""
        hub = self._hub
        if self._has_read_all and not hub.closed and (self._watch is None or not self._watch.due):
            self._waits = True
            hub.turns.at_news(self, turn)
        else:
            hub.turns.soon(self, turn)

    def _take(self) -> Batch:
        """Take what is wanted of the next `BATCH` events that have happened already."""
        hub, after = self._hub, self._position
        if self._waits:
            self._in_time, self._waits = hub.last, False
        elif self._in_time is not None and hub.last - max(self._in_time, after) > MAX_BACKLOG:
            hub.slow_consumers += 1
            raise SlowConsumer(self.cursor)
        if self._missed_after is not None or after < hub.first - 1:
            return Batch(self._skip_to_first())
        if self._snapshot_due:
            self._snapshot_due = False
            return Batch(hub.snapshot_at(after, self._wanted))
        if after == hub.last and self._watch is not None and self._watch.due:
            return hub.readings(self._watch.take(), hub.live.last, after, self._wanted)
        self._position = min(after + BATCH, hub.last)
        return hub.batch(after, self._position, self._wanted)

    async def page(self, limit: int) -> "Page":
        """Take at most `limit` events that have happened already."""
        events: list[Event] = []
        while len(events) < limit and not self._has_read_all:
            events += self._take().events
            await asyncio.sleep(0)
        if events and events[0].type == GAP:
            limit = max(limit, 2)  # the snapshot cannot be had later
        if len(events) <= limit:
            return Page(events, self.cursor)
        return Page(events[:limit], events[limit - 1].cursor)

    def _skip_to_first(self) -> list[Event]:
        requested = self._missed_after or self.cursor
        self._missed_after, self._snapshot_due = None, False
        self._position = self._hub.first - 1
        return self._hub.gap_before(self._position + 1, requested, self._wanted)


def _wake(turn: "asyncio.Future[None]") -> None:
    if not turn.done():
        turn.set_result(None)


def _nothing() -> None:
    """Wake no client."""


@dataclass(frozen=True, slots=True)
class Page:
    """Events from the list, and the cursor after which the next page begins."""

    events: list[Event]
    cursor: str


class KeptEvent(NamedTuple):
    """An event as it is kept."""

    type: str
    subject: str
    json: str


class EventRing:
    """Keeps the newest events, numbered from the one after `begun`."""

    def __init__(self, capacity: int, begun: int = 0) -> None:
        self.first = begun + 1
        """Number of the oldest event that is kept."""
        self.last = begun
        """Number of the newest event; `begun` before the first."""
        self._capacity = capacity
        self._begun = begun
        self._packed: deque[bytes] = deque()
        """Events as compressed texts.

        Texts and bytes are nothing to the garbage collector, which would hold the loop for 100 ms to look
        through objects (decision 9).
        """
        self._dropped = 0
        """Blocks that are no longer kept."""
        self._newest: list[KeptEvent] = []
        self._block = lru_cache(UNPACKED)(self._unpack)

    def append(self, event: KeptEvent) -> None:
        """Keep one more event, for which the oldest may go."""
        self.last += 1
        self.first = max(self.first, self.last - self._capacity + 1)
        self._newest.append(event)
        if len(self._newest) == BLOCK:
            self._packed.append(zlib.compress("\n".join(map("\n".join, self._newest)).encode(), LEVEL))
            self._newest = []
        if self._begun + (self._dropped + 1) * BLOCK < self.first:
            self._packed.popleft()
            self._dropped += 1

    def __getitem__(self, number: int) -> KeptEvent:
        """Give an event, from `first` to `last`."""
        block, place = divmod(number - 1 - self._begun, BLOCK)
        if block == self._dropped + len(self._packed):
            return self._newest[place]
        return self._block(block)[place]

    def _unpack(self, block: int) -> list[KeptEvent]:
        texts = iter(zlib.decompress(self._packed[block - self._dropped]).decode().split("\n"))
        return list(map(KeptEvent, texts, texts, texts))


class Turns:
    """Gives each waiting task a turn: at news, and soon where there is more to be done.

    Turns come in slices with pauses between them. All news of a pause is worth one turn, not many.
    """

    def __init__(self, clock: Callable[[], float] = perf_counter) -> None:
        self._clock = clock
        self._due: OrderedDict[object, Turn] = OrderedDict()
        self._waiting: OrderedDict[object, Turn] = OrderedDict()
        self._new = False
        self._next: asyncio.Handle | None = None

    @property
    def idle(self) -> bool:
        """True if no task waits for a turn."""
        return not self._due and not self._waiting

    def at_news(self, whose: object, turn: Turn) -> None:
        """Give the owner a turn at the next news."""
        self._waiting[whose] = turn

    def soon(self, whose: object, turn: Turn) -> None:
        """Give the owner a turn after those that are due."""
        self._due[whose] = turn
        self._go_on()

    def wake(self, whose: object) -> None:
        """Give a waiting owner a turn: there is news for it alone."""
        if turn := self._waiting.pop(whose, None):
            self.soon(whose, turn)

    def forget(self, whose: object) -> None:
        """Give the owner no turn."""
        self._waiting.pop(whose, None)
        self._due.pop(whose, None)

    def news(self) -> None:
        """Note that there is news."""
        if self._waiting:
            self._new = True
            self._go_on()

    def _go_on(self) -> None:
        if self._next is None:
            self._next = asyncio.get_running_loop().call_soon(self._slice)

    def _slice(self) -> None:
        began = self._clock()
        if self._new and not self._due:
            self._due, self._waiting, self._new = self._waiting, self._due, False
        left, now = SLICE, began
        while self._due and left and now - began <= SLICE_S:
            _, turn = self._due.popitem(last=False)
            do_each("a turn", turn)
            left -= 1
            now = self._clock()
        pause_s = min(PAUSE * (now - began), LONGEST_PAUSE_S)
        self._next = asyncio.get_running_loop().call_later(pause_s, self._resume)

    def _resume(self) -> None:
        self._next = None
        if self._due or self._new:
            self._slice()


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
        self.slow_consumers = self.gaps = 0
        """Subscriptions that ended by `SlowConsumer`, and gaps that were told."""
        self._clock = clock
        self._capacity = capacity
        self._ring = EventRing(capacity)
        self._earlier: Mapping[str, int] = {}
        """Epochs that were before, each with the number of its last event."""
        self.turns = Turns()
        """The order in which subscriptions read."""
        self.batch = lru_cache(SHARED_BATCHES)(self._batch)
        self.live = Live(self.epoch, _SOURCE, clock)
        """The newest values, which are no events."""
        self.readings = lru_cache(SHARED_BATCHES)(self._readings)
        self.take_snapshot: Callable[[Filter, str], Data] | None = None
        """Tells of what is wanted how it is now, with the cursor of the newest event."""
        self.listeners = Observers[[Event]]("an event")
        """Called with each event, in this order, before a client reads it."""

    def resume(
        self, epoch: str, earlier: Mapping[str, int], last: int, events: Sequence[tuple[str, str, str]]
    ) -> None:
        """Go on after the last event of an earlier life; `events` are the newest up to that."""
        self.epoch, self._earlier, self.last = epoch, earlier, last
        self._ring = EventRing(self._capacity, last - len(events))
        for event in events:
            self._ring.append(KeptEvent(*event))

    @property
    def first(self) -> int:
        """Number of the oldest event that can still be read."""
        return self._ring.first

    @property
    def cursor(self) -> str:
        """Cursor of a client that wants everything from now on."""
        return _cursor(self.epoch, self.last)

    def publish(self, type_: str, subject: str, data: Data, correlation: str | None = None) -> Event:
        """Number an event and keep it; it can be read as soon as this returns."""
        event = self._event(self.last + 1, type_, subject, data, correlation)
        self._keep(event)
        self.listeners(event)
        self.turns.news()
        return event

    def tell_again(self, type_: str, subject: str, text: str) -> None:
        """Tell an event of another life as it was told then; its number is the next."""
        self._keep(Event(self.epoch, self.last + 1, type_, subject, text))
        self.turns.news()

    def _keep(self, event: Event) -> None:
        self._ring.append(KeptEvent(event.type, event.subject, event.json))
        self.last = event.number

    def close(self) -> None:
        """End all subscriptions once they have read what there is: the gateway is shutting down."""
        self.closed = True
        self.turns.news()

    def subscribe(
        self,
        after: str | None = None,
        bodies: Iterable[str] | None = None,
        types: Iterable[str] | None = None,
        sample: float | None = None,
        *,
        snapshot: bool = False,
    ) -> Subscription:
        """Begin after a cursor, or now; a cursor that cannot be continued is answered with a `GAP` first.

        With a `sample` there are live values, too, each at most `sample` times a second. With a `snapshot` it
        begins with the events that follow a gap.

        :raises InvalidRequest: the cursor or a filter is malformed.
        """
        wanted = Filter.of(bodies, types)
        return self._read(self.cursor if after is None else after, wanted, sample, snapshot=snapshot)

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
        return await reader.page(min(limit, MAX_PAGE))

    async def values(
        self, bodies: Iterable[str] | None, types: Iterable[str] | None, sample: float
    ) -> Sequence[Event]:
        """Read live values for a client that does not stay: those that come first, within a second.

        :raises InvalidRequest: a filter is malformed.
        """
        wanted, read = Filter.of(bodies, types), asyncio.Event()
        with Watch(self.live, wanted, sample, read.set) as watch:
            await happens(read, VALUES_WITHIN_S)
            return self.readings(watch.take(), self.live.last, self.last, wanted).events

    def event(self, number: int) -> Event:
        """Give a retained event, from `first` to `last`."""
        return Event(self.epoch, number, *self._ring[number])

    def gap_before(self, number: int, requested: str, wanted: Filter) -> list[Event]:
        """Make the events that stand for those between a requested cursor and an event number."""
        self.gaps += 1
        data = {"requested": requested, "first_available": _cursor(self.epoch, number)}
        gap = self._event(number - 1, GAP, "/events", data)
        return [gap, *self.snapshot_at(number - 1, wanted)]

    def snapshot_at(self, number: int, wanted: Filter) -> list[Event]:
        """Take a snapshot of what a client wants, for events after the number."""
        if self.take_snapshot is None:
            return []
        return [self._event(number, SNAPSHOT, "/events", self.take_snapshot(wanted, self.cursor))]

    def _event(
        self, number: int, type_: str, subject: str, data: Data, correlation: str | None = None
    ) -> Event:
        """Write an event as `CloudEvent` has it; the model itself would take three times as long."""
        cursor = _cursor(self.epoch, number)
        told = {
            "specversion": "1.0",
            "id": cursor + _MADE_FOR_ONE.get(type_, ""),
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

    def _batch(self, after: int, last: int, wanted: Filter) -> Batch:
        """Look once for all clients with a filter; `batch` gives each the same one."""
        events = map(self.event, range(after + 1, last + 1))
        return Batch([event for event in events if wanted.wants(event)])

    def _readings(self, has: int, last: int, position: int, wanted: Filter) -> Batch:
        """Give the readings from after `has` to `last`, to all who have read the events to a position."""
        del last  # the newest of each, whatever its number: it tells the batches apart
        cursor = _cursor(self.epoch, position)
        return Batch(
            [
                Event(self.epoch, position, event.type, event.subject, f'{event.json},"cursor":"{cursor}"}}')
                for event in self.live.newer(has, wanted)
            ]
        )

    def _read(
        self, after: str, wanted: Filter, sample: float | None = None, *, snapshot: bool = False
    ) -> Subscription:
        match = _CURSOR.fullmatch(after)
        if match is None:
            raise InvalidRequest(
                f"{after!r} is no cursor.", f"Give the cursor of an event, such as {self.cursor}."
            )
        epoch, number = match[1], int(match[2])
        begin_at = partial(Subscription, self, wanted=wanted, sample=sample, snapshot=snapshot)
        if epoch == self.epoch and number <= self.last:
            return begin_at(number, missed_after=None)
        if epoch in self._earlier:  # it may have seen more of it than the journal has
            return begin_at(min(number, self._earlier[epoch]), missed_after=None)
        return begin_at(self.first - 1, missed_after=after)


def _cursor(epoch: str, number: int) -> str:
    return f"{epoch}-{number:012d}"
