"""The driver of a line: its port kept open, set up and paced, and a session carried over it.

The driver writes each frame that may go, cuts received bytes into frames, and has them credited.
"""

import asyncio
import logging
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import AsyncIterator, Callable, Collection, Coroutine, Iterable, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from functools import cached_property, partial
from math import inf
from typing import Any, ClassVar, Generic, Protocol, TypeVar, cast

from gateway.core.admission import Admission
from gateway.core.errors import (
    Cancelled,
    GatewayError,
    InvalidRequest,
    NoReply,
    Overtaking,
    PortNotOpen,
    StoppedFirst,
)
from gateway.core.exchange import F, Lane, Series, X
from gateway.core.false_replies import ECHOING, PAUSE_S, EchoPauses
from gateway.core.journal.intents import Intents
from gateway.core.line_state import LineState, PortAction, PortLife, PortNews, PortState
from gateway.core.origin import ORIGIN, PROBE, SET_UP, acting, current
from gateway.core.sequence_lock import SequenceLock, all_held
from gateway.core.session import Session
from gateway.core.supervisor import FaultsTo, do_each, supervise
from protocols.lines import Garbage
from protocols.table import Effect
from transports.base import Transport, TransportError, TransportLost, TransportRefused
from transports.recorder import Recorder
from transports.trace import UNNAMED, FrameSubject

log = logging.getLogger(__name__)

SILENCE_S = 0.05
"""The line must be quiet this long after the first bytes of an opening."""
_LANES = {lane: lane.name.lower() for lane in Lane}
LOST_S = 1.0
"""A timer that is later than this was lost by a fault of the gateway itself."""
REOPEN_S = (0.2, 5.0)
"""First and longest pause before a lost port is tried again; it doubles in between."""

LOST_REMEDY = "Read status and position."
REMEDY = "Mend that, or check the cable; the gateway goes on trying the port."
GAP_S = 0.1
"""A reply that has begun may pause this long before it counts as cut off."""
TURNAROUNDS = 16
"""Replies in the mean of the turnaround time."""
ORDER_TOLD_S = 3600.0
"""Seconds of order after which replies out of order are told again."""
EXPIRY_STEP_S = 0.05
"""Seconds between looks for expired exchanges, at least: a waiting crowd must not take the line's time."""

W_co = TypeVar("W_co", covariant=True)
W = TypeVar("W")
"""Frames that a reader cuts out of received bytes: replies, and messages that come without a question."""


class FrameReader(Protocol[W_co]):
    """Cuts what comes into frames."""

    def feed(self, data: bytes, /) -> Iterable[W_co]:
        """Take bytes, give the frames that are complete now."""

    def pending(self) -> int:
        """Bytes of a frame that has begun and not ended."""


@dataclass(slots=True)
class LineOwnership:
    """The gateway that has a line, as its ownership tells."""

    stands_by: Callable[[], str | None] = lambda: None
    """Called before each opening: why another gateway has the line; None where this one does."""
    other: Callable[[], str | None] = lambda: None
    """The other gateway that is known to have it, if any."""
    on_lost: Callable[[], object] = lambda: None
    """Called when the port was open and is not any more."""


@dataclass(slots=True)
class PortPace:
    """When a frame may be written, in the event loop's time."""

    free_at: float = 0.0
    """Time at which the last bit of the last frame leaves."""
    heard_at: float = 0.0
    """Time at which bytes last came."""
    heard_bytes: int = 0
    """Bytes heard since the last frame was written."""
    stuck_since: float | None = None
    """Time since which the port takes no bytes."""
    held_s: float = 0.0
    """Seconds for which the event loop had been held when that was seen last."""
    all_answered: bool = False
    """True if every frame was answered: none of them can wait in the port."""


class EarliestTimer:
    """One timer, at the earliest moment that anything is due."""

    __slots__ = ("_handle", "_ring", "_survived", "due_at")

    def __init__(self, ring: Callable[[], None], survived: FaultsTo) -> None:
        """`survived` heeds a fault of the gateway itself that `ring` has met."""
        self._ring, self._survived = ring, survived
        self._handle: asyncio.TimerHandle | None = None
        self.due_at = 0.0

    def set(self, at: float) -> None:
        """Ring at this time of the loop, unless it rings before."""
        loop = asyncio.get_running_loop()
        if self._handle is not None:
            if loop.time() - LOST_S < self.due_at <= at:
                return
            self._handle.cancel()
        # Kept beside the handle: uvloop's handles of timers that are due at once do not tell their time.
        self._handle, self.due_at = loop.call_at(at, self._fire), at

    def _fire(self) -> None:
        self._handle = None
        with self._survived:
            self._ring()


class PortLoop(ABC):
    """The common part of the lines of all protocols. All its methods belong to the event loop's thread."""

    def __init__(self, line_id: str, transport: Transport, counters: Counter[str]) -> None:
        self.id = line_id
        self.transport = transport
        self.counters = counters
        self.admission = Admission()
        """Admission of new work; a plant's lines share one."""
        self.recorder = Recorder(capacity=0)
        """Recorder of the port, if it is recorded."""
        self.on_change: Callable[[str, dict[str, object]], None] = lambda _what, _facts: None
        self.on_work: Callable[[], None] = lambda: None
        """Called at every write and every attempt to open; feeds the watchdog."""
        self.owner = LineOwnership()
        self._life = PortLife()
        self.byte_time_s = transport.byte_time_s
        """Seconds one byte takes on the wire; 0.0 where that does not pace the gateway."""
        self._wire = PortPace()
        self._timer = EarliestTimer(self._wake, self._survived)
        self._attention = asyncio.Event()
        """Set while a set-up is due, and when the port was lost."""
        self._tasks: list[asyncio.Task[None]] = []
        self._loop: asyncio.AbstractEventLoop

    # what a protocol adds

    @abstractmethod
    async def _set_up(self, *, fresh: bool) -> None:
        """Make the far end ready for use; `fresh` after the port was opened."""

    @abstractmethod
    def _break_off(self, reason: str) -> None:
        """The port has gone: tell everybody who waits, and forget what was half read."""

    @abstractmethod
    def _pump(self) -> None:
        """Write whatever may go now."""

    @abstractmethod
    def _pass_deadlines(self, now: float) -> float | None:
        """Give up waiting for what is overdue, and tell when to look again."""

    @abstractmethod
    def _wait_longer(self, seconds: float) -> None:
        """Move all deadlines by `seconds`."""

    @abstractmethod
    def data_received(self, data: bytes) -> None:
        """Bytes from the port."""

    @abstractmethod
    def _in_step(self) -> bool:
        """Say whether replies can be believed."""

    def _beside(self) -> Iterable[Callable[[], Coroutine[Any, Any, None]]]:
        """Tasks that run beside the port for as long as the line lives."""
        return ()

    # life

    def start(self) -> None:
        """Begin, once, to open the port, and to open it again whenever it is lost."""
        if self._tasks:
            return
        self._loop = asyncio.get_running_loop()
        self._tasks = [self._port_task()]
        with acting(PROBE):
            self._tasks += [supervise(f"the work beside line {self.id}", work) for work in self._beside()]

    def retire(self, why: str) -> None:
        """Let nothing more be written; `close` is to follow at once."""
        self._went_down(why, news=PortNews.END)

    async def close(self) -> None:
        """Cancel what waits, close the port and end all tasks. Bytes that were written stay written."""
        if not self._life.has_ended:
            self._went_down("the gateway is shutting down", news=PortNews.END, level=logging.INFO)
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self.transport.close()

    @asynccontextmanager
    async def lent(self, why: str) -> AsyncIterator[None]:
        """Lend the port to another user; the line is down meanwhile, and opens it anew after that."""
        opening, *beside = self._tasks
        opening.cancel()
        try:
            await asyncio.gather(opening, return_exceptions=True)
            self._went_down(why, level=logging.INFO)
            await self.transport.close()
            yield
        finally:
            if not self._life.has_ended:
                self._tasks = [self._port_task(), *beside]

    def _port_task(self) -> "asyncio.Task[None]":
        with acting(SET_UP):
            return supervise(f"the port of line {self.id}", self._keep_open)

    @property
    def baud(self) -> int | None:
        """The speed of the wire; None where the port does not tell."""
        return round(10 / self.byte_time_s) if self.byte_time_s else None

    @property
    def state(self) -> LineState:
        """State of the line now."""
        told = self._life.told
        return LineState.OUT_OF_STEP if told is LineState.READY and not self._in_step() else told

    @property
    def trouble(self) -> str | None:
        """Reason for which the port is not open, or no controller answers on it; None if neither is so."""
        return self._life.trouble

    @property
    def down_reason(self) -> str:
        """Why the line was down or silent last."""
        return self._life.why

    @property
    def _set_up_due(self) -> bool:
        return self._attention.is_set()

    async def _keep_open(self) -> None:
        pause_s = REOPEN_S[0]
        while not self._life.has_ended:
            self.on_work()
            if self._has_to_wait():
                await asyncio.sleep(REOPEN_S[0])
                continue
            with self._survived:  # passed on, it would leave the port open, and nobody told
                try:
                    await self.transport.open(self)
                    self.counters["openings"] += 1
                    if self._life.take(PortNews.OPENED) is not PortAction.CLOSE:
                        if await self._serve_until_lost():
                            pause_s = REOPEN_S[0]
                        if not self._life.has_ended:
                            self.owner.on_lost()
                except TransportError as error:
                    self._went_down(str(error))
            await self.transport.close()
            await asyncio.sleep(pause_s)
            pause_s = min(2 * pause_s, REOPEN_S[1])

    def _has_to_wait(self) -> bool:
        """True while another gateway has the line: then its port is not opened."""
        why = self.owner.stands_by()
        if why is None:
            self._life.take(PortNews.OURS)
            return False
        if self._life.state is not PortState.STANDBY or why != self.down_reason:
            self._went_down(why, news=PortNews.ELSEWHERE, level=logging.INFO)
        return True

    def is_elsewhere(self) -> bool:
        """Say whether another gateway is known to have the line, and stops what is on it."""
        return self.owner.other() is not None

    def hand_over(self, why: str) -> None:
        """Close the port, because another gateway has the line now."""
        self._went_down(why, news=PortNews.ELSEWHERE)

    async def _serve_until_lost(self) -> bool:
        """Serve the port until it is lost; say whether the line was ready. If not, the next try is later."""
        was_ready, fresh = False, True
        while self._life.is_open:
            self._attention.clear()
            await self._set_up(fresh=fresh)
            was_ready, fresh = was_ready or self._life.is_set_up, False
            await self._attention.wait()
        return was_ready

    def _went_down(
        self,
        why: str,
        fault: Exception | None = None,
        *,
        news: PortNews = PortNews.LOST,
        level: int = logging.WARNING,
    ) -> None:
        reason = why.removesuffix("Nothing was sent.").rstrip(" .")  # sentences say so themselves
        changed = self._life.is_open or reason != self.down_reason
        action = self._life.take(news, reason)
        self._wire.all_answered, self._wire.stuck_since = False, None
        self._break_off(self.down_reason)
        if changed:
            log.log(level, "line %s is down: %s", self.id, self.down_reason, exc_info=fault)
        self._tell_of(action)
        self._attention.set()

    def _begins_set_up(self) -> None:
        """Nothing but stops and the set-up is said from now on."""
        self._life.take(PortNews.SET_UP)

    def _came_up(self, facts: dict[str, object]) -> None:
        """Note that controllers answer and are set up; told once, until the line is down or silent."""
        action = self._life.take(PortNews.ANSWERED)
        if self._life.is_open:
            log.info("line %s is up", self.id)
        self._tell_of(action, facts)

    def _is_silent(self, why: str, news: PortNews = PortNews.SILENCE) -> None:
        """Note that no controller answers: for users of the line that is as if it were down."""
        if why != self.trouble:
            log.warning("line %s is silent: %s", self.id, why)
        self._tell_of(self._life.take(news, why))

    def _tell_of(self, action: PortAction, facts: dict[str, object] | None = None) -> None:
        if action is PortAction.TELL_UP:
            self.on_change("line.up", facts or {})
        elif action is PortAction.TELL_DOWN:
            self.on_change("line.down", {"reason": self.down_reason})

    def _down(self) -> PortNotOpen:
        return PortNotOpen(f"Line {self.id} is down: {self.down_reason}. Nothing was sent.", REMEDY)

    def set_up_again(self, reason: str) -> None:
        """The far end shows signs of a restart: tell it everything again."""
        log.warning("line %s: %s; setting it up again", self.id, reason)
        self.counters["set_ups_again"] += 1
        self._attention.set()

    def connection_lost(self, error: TransportLost) -> None:
        """Note that the port has gone without `close`."""
        self._went_down(str(error))

    async def _clear_with(self, opening: bytes, patience_s: float) -> None:
        """End whatever an earlier life may have left half said at the far end, then wait for silence.

        A line that is never silent is used nevertheless: what it does then tells people more than waiting.
        """
        if not self._send(opening, self._loop.time()):
            return
        wire = self._wire
        wire.heard_at = wire.free_at
        patience_ends_at = wire.free_at + patience_s
        while self._life.is_open:
            rest_s = min(wire.heard_at + SILENCE_S, patience_ends_at) - self._loop.time()
            if rest_s <= 0:
                return
            await asyncio.sleep(rest_s)

    # writing

    def _port_is_free(self, now: float) -> bool:
        """Say whether a frame may begin now; if not, everything is looked at again at the right moment.

        A port that stays blocked is opened anew.
        """
        wire = self._wire
        if now < wire.free_at and not (wire.all_answered and self.transport.is_bridged):
            self._timer.set(wire.free_at)
            return False
        if wire.all_answered or self.transport.unsent() == 0:
            wire.stuck_since = None
            return True
        if wire.stuck_since is None:
            wire.stuck_since = now
        if now - wire.stuck_since > self.transport.stuck_s:
            self._went_down(f"{self.transport.address} takes no bytes")
        else:
            self._timer.set(now + 0.001)
        return False

    def _send(self, frame: bytes, now: float) -> bool:
        """Hand a frame to the port, and know when its last bit will have left; False if the port has gone."""
        self.on_work()
        origin = current()
        self.recorder.sender = origin.caller, origin.request_id
        try:
            self.transport.write(frame)
        except TransportLost as error:
            self._went_down(str(error))
            return False
        self._wire.all_answered = False
        self._wire.free_at = now + len(frame) * self.byte_time_s
        return True

    # time

    def _note_hold(self, held_s: float) -> None:
        """Move all deadlines by the time for which the loop was held: in it no reply could be read."""
        wire = self._wire
        longer_s, wire.held_s = held_s - wire.held_s, held_s
        if wire.stuck_since is not None:
            wire.stuck_since += longer_s
        self._wait_longer(longer_s)

    def _wake(self) -> None:
        now = self._loop.time()
        held_s = self.admission.held_s(now)
        if held_s > self._wire.held_s:
            self._note_hold(held_s)
        deadline = self._pass_deadlines(now)
        if deadline is not None:
            self._timer.set(deadline)
        self._pump()

    @cached_property
    def _survived(self) -> FaultsTo:
        return FaultsTo(self._survive)

    def _survive(self, fault: Exception) -> None:
        """After a fault of the gateway itself nothing under way is believed, and the port is opened anew."""
        self._went_down(f"a fault of the gateway itself, {type(fault).__name__}: {fault}", fault)


class LineDriver(PortLoop, Generic[X, W, F]):
    """A port with its session: what is asked waits there for its turn, and not for longer than it may."""

    _unasked: ClassVar[tuple[type, ...]] = ()
    """Types of the frames that come without a question."""

    def __init__(
        self,
        line_id: str,
        transport: Transport,
        session: Session[X, F],
        reader: Callable[[], FrameReader[W | Garbage]],
    ) -> None:
        super().__init__(line_id, transport, session.counters)
        self._session = session
        self.reply_timeout_s, self.late_reply_s = session.terms.reply_timeout_s, session.terms.late_reply_s
        """Seconds to wait for a reply, and after that for one that is late."""
        session.order.on_overtaken = self._was_overtaken
        self._in_order_since = -inf
        """Time at which replies last came out of order."""
        self.gate = session.gate
        """Guards that every frame has to pass."""
        self._locks: dict[int, SequenceLock] = {}
        """Sequence locks of targets."""
        self._new_reader = reader
        self._reader = reader()
        self.intents: Intents[X] | None = None
        """Journal of intents, in which frames with an effect are written down first; None without one."""
        self._promised: dict[asyncio.Future[Any], X] = {}
        """Exchanges by the future of a waiter."""
        self._expiry = EarliestTimer(self._expire, self._survived)
        self.turnaround_s = 0.0
        """Mean time from a frame to its reply of late, without the bytes of the reply, in seconds."""
        self._held_when_heard_s = 0.0
        """Seconds for which the event loop had been held when a reply was last heard."""
        session.echo.on_change = self._echo_changed
        self._pauses = EchoPauses()
        self.load = session.load

    @property
    def echoes(self) -> bool:
        """True while what is written comes back as it was."""
        return self._pauses.echoes

    def held_since_heard_s(self, now: float) -> float:
        """For how long the event loop was held since a reply was heard."""
        return self.admission.held_s(now) - self._held_when_heard_s

    def waiting(self) -> dict[str, int]:
        """Number of exchanges that wait in each lane."""
        return {name: self._session.waiting(lane) for lane, name in _LANES.items()}

    def load_percent(self) -> dict[str, float]:
        """The share of the last ten seconds that each kind of work took."""
        return self.load.percent(self._loop.time())

    def require_fit(self) -> None:
        """Refuse what comes too late, or to a line that echoes.

        :raises ShuttingDown, HeldUp: as of `Admission.require`.
        :raises LineDown: it echoes.
        """
        self.admission.require()
        if self.echoes:
            raise self._echoes()

    def shows_silence(self, error: GatewayError) -> bool:
        """Say whether an error shows that the controller which was asked does not answer."""
        return isinstance(error, NoReply)

    def lock_of(self, target: int) -> SequenceLock:
        """The lock of a target, for series of commands that nothing but stops may divide."""
        lock = self._locks.get(target)
        if lock is None:
            scheduler = self._session.scheduler
            lock = self._locks[target] = SequenceLock(scheduler.waits_for, target, scheduler.holders)
            lock.on_free = self._pump
        return lock

    @asynccontextmanager
    async def undivided(
        self, targets: Iterable[int], expires_at: float | None = None
    ) -> AsyncIterator[Series]:
        """Send a series to several targets that nothing but stops divides. A stop of one of them ends it.

        :raises QueueFull, Expired: one of them was not free in time.
        """
        numbers = sorted({number for target in targets for number in self._session.scheduler.reached(target)})
        async with all_held(map(self.lock_of, numbers), expires_at) as series:
            series.epochs = {number: self.gate.epoch(number) for number in numbers}
            yield series

    def subject_of(self, _: bytes) -> FrameSubject:
        """Find the subject of a frame; where frames have no address, all have the same."""
        return FrameSubject(UNNAMED)

    def _hear(self, message: W) -> None:
        """Hear a frame of a type that comes without a question."""

    def _in_step(self) -> bool:
        return self._session.in_step

    def revoke(self, why: Overtaking) -> None:
        """Send no command that was admitted before now and is not written yet."""
        self._session.revoke(why)
        self._cancel_held(lambda _: True, why())

    def fence(self) -> None:
        """Let nothing but stops go before it is proved that no earlier reply is still to come."""
        if self._life.is_set_up:
            self._session.fence()
            self._loop.call_soon(self._pump)

    def _pump(self) -> None:
        """Write whatever may go now; a frame at a time, so that a stop leaves at the next frame boundary."""
        with self._survived:
            goes_on = self._life.is_open and self._session.has_something()
            while goes_on and self._life.is_open:
                now = self._loop.time()
                held_s = self.admission.revised(now)  # what is older than a suspension is not written
                if held_s > self._wire.held_s:
                    self._note_hold(held_s)
                ready = self._life.is_set_up
                if not self._port_is_free(now):
                    return
                if now < self._pauses.until and not self._session.is_urgent():
                    self._timer.set(self._pauses.until)
                    return
                exchange = self._session.next(now, ready=ready)
                if exchange is None:
                    return
                goes_on = self._write(exchange, now)

    def _survive(self, fault: Exception) -> None:
        """Tell those, too, whose exchange the fault has dropped: they would wait for ever."""
        super()._survive(fault)
        for exchange in list(self._promised.values()):
            lost = f"{exchange.sent}, or not: {self.down_reason}."
            exchange.settle(NoReply(lost, exchange.remedy, exchange.command))

    def _write(self, exchange: X, now: float) -> bool:
        """Write for the one who asked: what that begins belongs to the same origin.

        Says whether another frame could follow.
        """
        before = ORIGIN.set(exchange.origin)
        try:
            if self._send(exchange.frame, now):
                if self.intents is not None:
                    self.intents.note_written(exchange)
                self._wire.heard_bytes = 0
                deadline = self._wire.free_at + exchange.reply.timeout_s
                goes_on = self._session.written(exchange, now, deadline)
                if self._pauses.echoes:
                    self._pauses.note_written(now, is_stop=exchange.command.effect is Effect.STOP)
                self._timer.set(deadline)
                return goes_on
            exchange.settle(self._down())
        except TransportRefused as error:
            exchange.settle(InvalidRequest(f"{error} Nothing was sent.", "Send less at once."))
        finally:
            ORIGIN.reset(before)
        return self._session.has_something()

    def data_received(self, data: bytes) -> None:
        """Bytes from the port."""
        self._wire.heard_at = self._loop.time()
        self._wire.heard_bytes += len(data)
        with self._survived:
            for frame in self._reader.feed(data):
                if isinstance(frame, Garbage):
                    self._receive_noise(frame)
                elif isinstance(frame, self._unasked):
                    self._hear(frame)
                else:
                    self._receive(cast("F", frame))

    # the echo

    def _echo_changed(self, found: bool) -> None:
        self._pauses.begin(found, self._loop.time())
        if not found:
            self.set_up_again("it echoes no longer")
            return
        self._is_silent(ECHOING)
        self._ask_on()
        self.cancel(self._is_unsafe, self._echoes())

    def _is_unsafe(self, exchange: X) -> bool:
        effect = exchange.command.effect
        return effect is Effect.MOTION or (
            effect is not Effect.STOP and not self._session.shows_echo(exchange)
        )

    def _ask_on(self) -> None:
        """Find out whether it still echoes, where nothing else is asked."""
        if self.echoes:
            self._loop.call_later(PAUSE_S[1], self._ask_on)
            if self._session.in_step and not self._session.has_something():
                self.fence()

    def _echoes(self) -> PortNotOpen:
        return PortNotOpen.worded("line.echoes", line=self.id)

    def _is_silent(self, why: str, news: PortNews = PortNews.SILENCE) -> None:
        super()._is_silent(ECHOING if self.echoes else why, news)

    def _came_up(self, facts: dict[str, object]) -> None:
        """Serve; but a line that echoes stays unusable, whatever was understood on it."""
        if self.echoes:
            self._is_silent(ECHOING, PortNews.UNANSWERED)
        else:
            super()._came_up(facts)

    def _pass_deadlines(self, now: float) -> float | None:
        resumes_at = self._wire.heard_at + GAP_S if self._reader.pending() else None
        self._session.pass_deadlines(now, resumes_at)
        return self._session.deadline()

    def _wait_longer(self, seconds: float) -> None:
        self._session.wait_longer(seconds)

    def forbid(self, targets: Collection[int]) -> None:
        """A stop of these targets begins: no command admitted before can be written any more."""
        for target in targets:
            self.gate.stop(target)
        self.cancel(
            lambda exchange: exchange.target in targets and exchange.lane is Lane.COMMAND, StoppedFirst()
        )

    def cancel(self, unwanted: Callable[[X], bool], reason: GatewayError) -> None:
        """Take out of the queue what is not wanted any more."""
        self._session.cancel(unwanted, reason)
        self._cancel_held(unwanted, reason)

    def _cancel_held(self, unwanted: Callable[[X], bool], reason: GatewayError) -> None:
        if self.intents is not None:
            self.intents.cancel(unwanted, reason)

    def _promise(self, exchange: X) -> "asyncio.Future[Any]":
        future: asyncio.Future[Any] = self._loop.create_future()
        exchange.waiters[future] = exchange.expires_at
        self._promised[future] = exchange
        future.add_done_callback(self._promised.pop)
        return future

    def queue(self, exchange: X) -> "asyncio.Future[Any]":
        """Let an exchange wait for its turn; the future gives what became of it and never raises.

        :raises LineDown: the line echoes, and it moves something, or an echo could answer it.
        """
        if self._pauses.echoes and self._is_unsafe(exchange):
            raise self._echoes()
        future = self._promise(exchange)
        if self.intents is not None and self.intents.must_come_first(exchange):
            self.intents.hold(exchange, self._admit)
        else:
            self._admit(exchange)
        return future

    async def reply_to(self, exchange: X) -> Any:
        """Let an exchange wait for its turn, and give its reply.

        :raises GatewayError: there is none; the error says why.
        """
        outcome = await self.queue(exchange)
        if isinstance(outcome, GatewayError):
            raise outcome
        return outcome

    @contextmanager
    def undertaking(self, exchanges: Callable[[], Iterable[X]]) -> Iterator[None]:
        """Wait for the disk once, whatever of these is sent here and now; `exchanges` is asked then."""
        if self.intents is None:
            yield
            return
        with self.intents.undertaking(exchanges):
            yield

    def _admit(self, exchange: X) -> None:
        """Let it wait for its turn from now on."""
        if not self._life.is_open:
            raise self._down()
        self._session.submit(exchange)
        self._pump()
        if exchange.expires_at is not None:
            self._expiry.set(exchange.expires_at)

    def address_of(self, target: int) -> str:
        """The address of what a frame is for, in the journal."""
        return f"{self.id}.{target:02X}"

    async def _say_first(self, exchange: X) -> Any:
        """Send what belongs to the set-up ahead of everything but stops and fences."""
        future = self._promise(exchange)
        self._session.put_first(exchange)
        self._pump()
        return await future

    def _expire(self) -> None:
        """Withdraw what is too late; one timer for all that waits."""
        now = max(self._loop.time(), self._expiry.due_at)  # timers may fire a little early
        next_at = self._session.scheduler.expire(now)
        if next_at is not None:
            self._expiry.set(max(next_at, now + EXPIRY_STEP_S))

    def _receive(self, reply: F) -> None:
        """Hear a reply; the next frame goes out before its waiters have it."""
        settle = self._session.receive(reply, self._wire.heard_at)
        self._wire.all_answered = self._session.sent.all_answered
        if self._wire.all_answered:
            self._note_turnaround()
        self._pump()
        self._held_when_heard_s = self._wire.held_s
        if settle is not None:
            settle()

    def _note_turnaround(self) -> None:
        took_s = self._wire.heard_at - self._wire.free_at - self._wire.heard_bytes * self.byte_time_s
        self.turnaround_s += (min(max(took_s, 0.0), self.reply_timeout_s) - self.turnaround_s) / TURNAROUNDS

    def _was_overtaken(self, late: X, by: X) -> None:
        """A reply came after that to a later frame."""
        since, self._in_order_since = self._in_order_since, self._loop.time()
        if self._in_order_since - since >= ORDER_TOLD_S:
            self.on_change("line.order.violated", {"late": self._named(late), "before": self._named(by)})

    def _named(self, exchange: X) -> str:
        return f"{exchange.command.name()} of {self.address_of(exchange.target)}"

    def _receive_noise(self, what: Garbage) -> None:
        """Hear what can be no reply."""
        self._session.garbage(what, self._wire.heard_at)
        self._pump()

    def _break_off(self, reason: str) -> None:
        """Settle all that waits for a port that has gone, and forget what was half read."""
        self._reader = self._new_reader()
        self._pauses = EchoPauses()
        unsent = Cancelled(f"Line {self.id} went down: {reason}. Nothing was sent.", "Try again later.")
        lost = NoReply(
            f"Line {self.id} was lost before the reply came: {reason}.", "Read status and position."
        )
        do_each(
            f"the end of line {self.id}",
            partial(self._session.break_off, lost, unsent),
            partial(self._cancel_held, lambda _: True, unsent),
        )
