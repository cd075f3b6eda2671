"""A session carried over its port: what may go is written, what comes is cut into frames and heard."""

import asyncio
from abc import abstractmethod
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import asynccontextmanager
from typing import Any, Generic, Protocol, TypeVar

from gateway.core.errors import Cancelled, GatewayError, InvalidRequest, NoReply, Overtaking
from gateway.core.exchange import F, X
from gateway.core.gate import Gate
from gateway.core.journal.intents import Intents
from gateway.core.lanes import Lane
from gateway.core.origin import acting
from gateway.core.port import PortLoop
from gateway.core.sequence_lock import SequenceLock, Series, all_held
from gateway.core.session import Session
from transports.base import Transport, TransportRefused

GAP_S = 0.1
"""A reply that has begun may pause this long before it counts as cut off."""
EXPIRY_STEP_S = 0.05
"""What has expired is looked for at most this often: a crowd that waits must not cost the line its time."""


W_co = TypeVar("W_co", covariant=True)
W = TypeVar("W")
"""What a reader cuts out of what comes: replies, and what is none."""


class Reader(Protocol[W_co]):
    """Cuts what comes into frames."""

    def feed(self, data: bytes, /) -> Iterable[W_co]:
        """Take bytes, give the frames that are complete now."""

    def pending(self) -> int:
        """Bytes of a frame that has begun and not ended."""


class LineDriver(PortLoop, Generic[X, W, F]):
    """A port with its session: what is asked waits there for its turn, and not for longer than it may."""

    def __init__(
        self, line_id: str, transport: Transport, session: Session[X, F], reader: Callable[[], Reader[W]]
    ) -> None:
        super().__init__(line_id, transport, session.counters)
        self._session = session
        self._new_reader = reader
        self._reader = reader()
        self.intents: Intents[X] | None = None
        """Where what has an effect is written down first, if anywhere."""
        self._expiry: asyncio.TimerHandle | None = None
        self._expiry_at = 0.0

    @property
    def gate(self) -> Gate[X]:
        """What every frame has to pass."""
        return self._session.gate

    @property
    def reply_timeout_s(self) -> float:
        """How long a reply is waited for, where its command takes no time of its own."""
        return self._session.reply_timeout_s

    @property
    def late_reply_s(self) -> float:
        """How long after its deadline a reply may still arrive."""
        return self._session.late_reply_s

    def waiting(self) -> dict[str, int]:
        """How many exchanges wait in each lane."""
        return {lane.name.lower(): self._session.waiting(lane) for lane in Lane}

    def lock_of(self, target: int) -> SequenceLock:
        """The lock of a target, for series of commands that nothing but stops may divide."""
        lock = self._session.sequence_lock(target)
        lock.on_free = self._pump
        return lock

    @asynccontextmanager
    async def undivided(
        self, targets: Iterable[int], expires_at: float | None = None
    ) -> AsyncIterator[Series]:
        """Send a series to several targets that nothing but stops divides. A stop of one of them ends it.

        :raises QueueFull, Expired: one of them was not free in time.
        """
        numbers = sorted({it for target in targets for it in self._session.targets(target)})
        async with all_held(map(self.lock_of, numbers), expires_at) as series:
            series.epochs = {number: self.gate.epoch(number) for number in numbers}
            yield series

    @abstractmethod
    def _take(self, frame: W) -> None:
        """Hear a frame, let the next one go, and only then settle what it answers."""

    def _in_step(self) -> bool:
        return self._session.in_step

    def revoke(self, why: Overtaking) -> None:
        """Send no command that was admitted before now and is not written yet."""
        self._session.revoke(why)
        self._cancel_held(lambda _: True, why())

    def fence(self) -> None:
        """Let nothing but stops go before it is proved that no earlier reply is still to come."""
        if self._ready:
            self._session.fence()
            self._loop.call_soon(self._pump)

    def _pump(self) -> None:
        """Write whatever may go now; a frame at a time, so that a stop leaves at the next frame boundary."""
        while self._open and self._has_something():
            now = self._loop.time()
            if not self._port_is_free(now):
                return
            exchange = self._session.next(now, ready=self._ready)
            if exchange is None:
                return
            self._write(exchange, now)

    def _has_something(self) -> bool:
        """Whether anything could go that was not asked for before a suspension."""
        if not self._session.has_something():
            return False
        self.admission.revise()
        return self._session.has_something()

    def _write(self, exchange: X, now: float) -> None:
        """Write for the one who asked: what that begins belongs to the same origin."""
        with acting(exchange.origin):
            self._hand_out(exchange, now)

    def _hand_out(self, exchange: X, now: float) -> None:
        try:
            written = self._send(exchange.frame, now)
        except TransportRefused as error:
            exchange.settle(InvalidRequest(f"{error} Nothing was sent.", "Send less at once."))
            return
        if not written:
            exchange.settle(self._down())
            return
        if self.intents is not None:
            self.intents.note_written(exchange)
        deadline = self._tx_free_at + exchange.timeout_s
        self._session.written(exchange, now, deadline)
        self._wake_at(deadline)

    def data_received(self, data: bytes) -> None:
        """Bytes from the port."""
        self._last_rx_at = self._loop.time()
        for frame in self._reader.feed(data):
            self._take(frame)

    def _pass_deadlines(self, now: float) -> float | None:
        resumes_at = self._last_rx_at + GAP_S if self._reader.pending() else None
        self._session.pass_deadlines(now, resumes_at)
        return self._session.deadline()

    def cancel(self, unwanted: Callable[[X], bool], reason: GatewayError) -> None:
        """Take out of the queue what is not wanted any more."""
        self._session.cancel(unwanted, reason)
        self._cancel_held(unwanted, reason)

    def _cancel_held(self, unwanted: Callable[[X], bool], reason: GatewayError) -> None:
        if self.intents is not None:
            self.intents.cancel(unwanted, reason)

    def _promise(self, exchange: X) -> "asyncio.Future[Any]":
        future: asyncio.Future[Any] = self._loop.create_future()
        exchange.wait_for(future)
        return future

    def _queue(self, exchange: X) -> "asyncio.Future[Any]":
        """Let an exchange wait for its turn; the future gives what became of it and never raises."""
        future = self._promise(exchange)
        if self.intents is not None and self.intents.must_come_first(exchange):
            self.intents.hold(exchange, self._admit)
        else:
            self._admit(exchange)
        return future

    def _admit(self, exchange: X) -> None:
        """Let it wait for its turn from now on."""
        if not self._open:
            raise self._down()
        self._session.submit(exchange)
        self._pump()
        if exchange.expires_at is not None:
            self._expire_at(exchange.expires_at)

    def address_of(self, target: int) -> str:
        """The address of what a frame is for, in the journal."""
        return f"{self.id}.{target:02X}"

    async def _say_first(self, exchange: X) -> Any:
        """Send what belongs to the set-up ahead of everything but stops and fences."""
        future = self._promise(exchange)
        self._session.put_first(exchange)
        self._pump()
        return await future

    def _expire_at(self, at: float) -> None:
        """Keep one timer for all that waits, at the earliest moment at which any of it is too late."""
        if self._expiry is not None:
            if self._expiry_at <= at:
                return
            self._expiry.cancel()
        self._expiry, self._expiry_at = self._loop.call_at(at, self._expire), at

    def _expire(self) -> None:
        self._expiry = None
        now = max(self._loop.time(), self._expiry_at)  # timers may fire a little early
        next_at = self._session.scheduler.expire(now)
        if next_at is not None:
            self._expire_at(max(next_at, now + EXPIRY_STEP_S))

    def _hear(self, reply: F) -> None:
        """Hear a reply; the next frame goes out before its waiters have it."""
        settle = self._session.heard(reply, self._last_rx_at)
        self._heard_out = settle is not None and self._session.is_heard_out()
        self._pump()
        if settle is not None:
            settle()

    def _hear_noise(self, what: str) -> None:
        """Hear what can be no reply."""
        self.counters["garbage"] += 1
        self._session.noise(what, self._last_rx_at)
        self._pump()

    def _break_off_all(self, reason: str, remedy: str) -> None:
        """Settle all that waits for a port that has gone, and forget what was half read."""
        self._reader = self._new_reader()
        unsent = Cancelled(f"Line {self.id} went down: {reason}. Nothing was sent.", "Try again later.")
        self._session.break_off(
            NoReply(f"Line {self.id} was lost before the reply came: {reason}.", remedy), unsent
        )
        self._cancel_held(lambda _: True, unsent)
