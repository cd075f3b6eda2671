"""The loop of one RC-400 line: writes what the scheduler gives it, credits replies, keeps the port open.

One exchange is under way at a time; only stops may be written while it waits for its reply. When a reply
stays away or cannot be understood, the line is out of step: nothing but stops is sent until a fence, the read
of a position entry whose number comes back, has proved that every earlier reply was seen or will never come.
"""

import asyncio
import logging
import random
from collections import Counter, deque
from collections.abc import Callable, Iterable
from enum import StrEnum
from typing import Any

from gateway.errors import (
    BodyOffline,
    Cancelled,
    ControllerRefused,
    GarbledReply,
    GatewayError,
    LineDown,
    NoReply,
)
from gateway.exchange import Answered, Exchange, Lane, Outcome
from gateway.gate import Gate
from gateway.scheduler import Scheduler
from protocols.rorze.link import (
    POISON,
    Answer,
    Frame,
    Garbage,
    GroupAnswer,
    LinkReader,
    MoveEnded,
    Refusal,
    StatusChanged,
    UnknownMessage,
    encode,
)
from protocols.rorze.link_master import IdentifyControllers, SetGroup, SetReplyFormat
from protocols.rorze.notation import PositionReference
from protocols.rorze.position_table import GetNumberedPositionEntry
from protocols.rorze.row import LAST_BODY, LINK_MASTER, RorzeCommand
from protocols.table import Retry
from transports.base import Transport, TransportError, TransportLost

log = logging.getLogger(__name__)

FENCE_TRIES = 3
READ_REPEATS = 2
"""How often a read without a usable reply is repeated, each time after a passed fence."""
SILENCE_S = 0.05
"""The line must be quiet this long after the poison of an opening."""
GAP_S = 0.1
"""A reply that has begun may pause this long before it counts as cut off."""
STUCK_S = 1.0
"""The port must take our bytes within this time, or it is opened anew."""
REOPEN_S = (0.2, 5.0)
"""First and longest pause before a lost port is tried again; it doubles in between."""
PROBE_S = (1.0, 10.0)
"""First and longest pause between probes of a body that does not answer."""


class LineState(StrEnum):
    """What a line can do for its users now."""

    DOWN = "down"
    SETTING_UP = "setting_up"
    READY = "ready"
    OUT_OF_STEP = "out_of_step"


class Line:
    """One port with its RC-400 and bodies. All its methods belong to the event loop's thread."""

    def __init__(
        self,
        line_id: str,
        transport: Transport,
        bodies: Iterable[int],
        *,
        introducer: str = "&",
        reply_timeout_s: float = 0.5,
        late_reply_s: float = 2.0,
        interject_stops: bool = True,
        rng: random.Random | None = None,
    ) -> None:
        self.id = line_id
        self.transport = transport
        self.bodies = list(bodies)
        self.groups: dict[int, list[int]] = {}
        self.introducer = introducer
        self.reply_timeout_s = reply_timeout_s
        self.late_reply_s = late_reply_s
        self.interject_stops = interject_stops
        self.gate = Gate()
        self.offline: set[int] = set()
        self.counters: Counter[str] = Counter()
        self.controllers = ""
        """What the link master answered to XID."""
        self.last_error_at: float | None = None
        self.down_reason = "not opened yet"
        self.on_message: Callable[[MoveEnded | StatusChanged | UnknownMessage], None] = lambda _: None
        self.on_change: Callable[[str, dict[str, object]], None] = lambda _what, _facts: None
        self._random = rng or random.Random()  # noqa: S311  # a nonce against mix-ups, not against people
        self._scheduler = Scheduler()
        self._reader = LinkReader()
        self._urgent: deque[Exchange] = deque()
        self._awaiting: Exchange | None = None
        self._stops: list[Exchange] = []
        self._suspect: Exchange | None = None
        self._out_of_step = False
        self._fence: Exchange | None = None
        self._fence_body = 0
        self._fence_tries = 0
        self._last_command: tuple[int, str] | None = None
        self._last_frame: Frame | None = None
        self._open = False
        self._ready = False
        self._tx_free_at = 0.0
        self._last_rx_at = 0.0
        self._stuck_since: float | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._attention = asyncio.Event()
        self._set_up_due = False
        self._tasks: list[asyncio.Task[None]] = []
        self._loop: asyncio.AbstractEventLoop

    # life

    def start(self) -> None:
        """Begin to open the port, and to open it again whenever it is lost."""
        self._loop = asyncio.get_running_loop()
        self._tasks = [
            asyncio.create_task(self._keep_open(), name=f"line {self.id}"),
            asyncio.create_task(self._probe_offline(), name=f"probes {self.id}"),
        ]

    async def close(self) -> None:
        """Cancel what waits, close the port and end all tasks. What was written stays written."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._went_down("the gateway is shutting down")
        await self.transport.close()

    @property
    def state(self) -> LineState:
        """What the line can do now."""
        if not self._open:
            return LineState.DOWN
        if not self._ready:
            return LineState.SETTING_UP
        return LineState.OUT_OF_STEP if self._out_of_step else LineState.READY

    def waiting(self) -> dict[str, int]:
        """How many exchanges wait in each lane."""
        return {lane.name.lower(): self._scheduler.waiting(lane) for lane in Lane}

    async def _keep_open(self) -> None:
        pause_s = REOPEN_S[0]
        while True:
            try:
                await self.transport.open(self)
            except TransportError as error:
                self._went_down(str(error))
            else:
                pause_s = REOPEN_S[0]
                self.counters["openings"] += 1
                self._open = True
                await self._serve_until_lost()
                await self.transport.close()
            await asyncio.sleep(pause_s)
            pause_s = min(2 * pause_s, REOPEN_S[1])

    async def _serve_until_lost(self) -> None:
        self._set_up_due = fresh = True
        while self._open:
            if self._set_up_due:
                self._set_up_due = False
                await self._set_up(fresh=fresh)
                fresh = False
            else:
                self._attention.clear()
                await self._attention.wait()

    async def _set_up(self, *, fresh: bool) -> None:
        """Tell the link master what it forgets at power-off: XID, XRSM1, the groups (RC-420 manual 17.2)."""
        self._ready = False
        if fresh:
            await self._poison()
        for command in (IdentifyControllers(), SetReplyFormat(end_of_move=1)):
            outcome = await self._internal(LINK_MASTER, command)
            if isinstance(outcome, Answered) and isinstance(command, IdentifyControllers):
                self.controllers = getattr(outcome.replies[LINK_MASTER], "text", "")
        for group, members in list(self.groups.items()):
            await self._internal(LINK_MASTER, _group_definition(group, members))
        if not self._open:
            return
        self._ready = True
        self.on_change("line.up", {"controllers": self.controllers})
        self._pump()

    async def _poison(self) -> None:
        """Kill whatever half command an earlier life may have left at the far end, then wait for silence.

        A line that is never silent is used nevertheless: what it does then tells people more than waiting.
        """
        try:
            self.transport.write(POISON)
        except TransportLost:
            return
        self._tx_free_at = self._loop.time() + len(POISON) * self.transport.byte_time_s
        self._last_rx_at = self._tx_free_at
        patience_ends_at = self._tx_free_at + self.late_reply_s
        while self._open:
            rest_s = min(self._last_rx_at + SILENCE_S, patience_ends_at) - self._loop.time()
            if rest_s <= 0:
                return
            await asyncio.sleep(rest_s)

    async def define_group(self, group: int, members: list[int]) -> None:
        """Define a virtual body at the link master, now and after every restart of it.

        :raises GatewayError: the link master did not take it; the old definition holds, or is sent again
            where nobody knows.
        """
        future = self.submit(LINK_MASTER, _group_definition(group, members), Lane.COMMAND)
        outcome = await future
        if isinstance(outcome, Refusal):
            raise ControllerRefused(f"{self.id}.7F", outcome.code, outcome.error)
        if isinstance(outcome, GatewayError):
            if isinstance(outcome, NoReply):
                self.set_up_again(f"nobody knows what group {group:02X} is now")
            raise outcome
        self.groups[group] = members

    def can_address(self, body: int) -> bool:
        """Whether the line's way of addressing reaches this body number."""
        return self.introducer == "&" or body <= 0xF

    def set_up_again(self, reason: str) -> None:
        """The link master shows signs of a restart: tell it everything again."""
        log.warning("line %s: %s; setting the link master up again", self.id, reason)
        self.counters["set_ups_again"] += 1
        self._set_up_due = True
        self._attention.set()

    def _went_down(self, reason: str) -> None:
        """Settle everything: what was written may have been executed, what waited was not."""
        was_open, self._open, self._ready = self._open, False, False
        changed = was_open or reason != self.down_reason
        self.down_reason = reason
        self._reader = LinkReader()
        written = [it for it in (*self._stops, self._suspect, self._awaiting) if it is not None]
        self._awaiting = self._suspect = self._fence = None
        self._out_of_step, self._stops, self._stuck_since = False, [], None
        self._urgent, waiting = deque(), [*self._urgent, *self._scheduler.remove(lambda _: True)]
        for exchange in written:
            lost = NoReply(
                f"Line {self.id} was lost before the reply came: {reason}.", "Read status and position."
            )
            exchange.settle(exchange.late_answer or lost)
        for exchange in waiting:
            exchange.settle(
                Cancelled(f"Line {self.id} went down: {reason}. Nothing was sent.", "Try again later.")
            )
        if changed:
            self.on_change("line.down", {"reason": reason})
        self._attention.set()

    # asking

    def submit(
        self,
        body: int,
        command: RorzeCommand[Any],
        lane: Lane,
        *,
        expires_at: float | None = None,
        on_written: Callable[[float], None] | None = None,
    ) -> "asyncio.Future[Outcome]":
        """Queue a command; the future gives what became of it and never raises.

        :raises LineDown: the port is not open; nothing was queued.
        :raises BodyOffline: the body does not answer (stops are sent nevertheless).
        :raises QueueFull: too many requests wait for this body.
        """
        if not self._open:
            raise LineDown(
                f"Line {self.id} is down: {self.down_reason}. Nothing was sent.", "Check the cable."
            )
        if body in self.offline and lane is not Lane.STOP:
            raise BodyOffline(
                f"Body {body:02X} does not answer; nothing was sent.", "Check its power and cable."
            )
        exchange = self._exchange(body, command, lane)
        exchange.expires_at, exchange.on_written = expires_at, on_written
        future: asyncio.Future[Outcome] = self._loop.create_future()
        exchange.waiters.append(future)
        self._scheduler.submit(exchange)
        if expires_at is not None:
            self._loop.call_at(expires_at, self._expire)
        self._pump()
        return future

    def cancel(self, unwanted: Callable[[Exchange], bool], reason: GatewayError) -> None:
        """Take out of the queue what is not wanted any more."""
        for exchange in self._scheduler.remove(unwanted):
            exchange.settle(reason)

    def probe(self, body: int, timeout_s: float) -> "asyncio.Future[Outcome]":
        """Ask a body, known or not, whether it is there, by a read that nothing else can be mistaken for."""
        exchange = self._nonce_read(body)
        exchange.timeout_s = timeout_s
        future: asyncio.Future[Outcome] = self._loop.create_future()
        exchange.waiters.append(future)
        if self._open:
            self._scheduler.submit(exchange)
            self._pump()
        else:
            exchange.settle(LineDown(f"Line {self.id} is down: {self.down_reason}."))
        return future

    def _exchange(self, body: int, command: RorzeCommand[Any], lane: Lane) -> Exchange:
        return Exchange(
            body,
            command,
            # The old forms have one digit of body number: groups and the link master have no place in it.
            encode(body, command, self.introducer if body <= 0xF else "&"),
            lane,
            epoch=self.gate.epoch(body),
            timeout_s=self.reply_timeout_s + 2 * command.takes_s,
            repeats=READ_REPEATS if command.may_repeat() else 0,
        )

    def _nonce_read(self, body: int) -> Exchange:
        slot = PositionReference(position=self._random.randrange(2048))
        exchange = self._exchange(body, GetNumberedPositionEntry(entry=slot), Lane.READ)
        exchange.self_identifying = True
        exchange.repeats = 0
        return exchange

    async def _internal(self, body: int, command: RorzeCommand[Any]) -> Outcome:
        """Send a set-up command ahead of everything but stops and fences."""
        exchange = self._exchange(body, command, Lane.COMMAND)
        exchange.repeats = READ_REPEATS  # absolute and harmless: saying it again changes nothing
        future: asyncio.Future[Outcome] = self._loop.create_future()
        exchange.waiters.append(future)
        if not self._open:
            return LineDown(f"Line {self.id} is down: {self.down_reason}.")
        self._urgent.append(exchange)
        self._pump()
        return await future

    def _expire(self) -> None:
        self._scheduler.expire(self._loop.time())

    # writing

    def _pump(self) -> None:
        """Write whatever may go now; a frame at a time, so that a stop leaves at the next frame boundary."""
        while self._open:
            now = self._loop.time()
            if now < self._tx_free_at:
                self._wake_at(self._tx_free_at)
                return
            if not self._port_takes_bytes(now):
                return
            exchange = self._next(now)
            if exchange is None:
                return
            refusal = self.gate.refuses(exchange, now)
            if refusal is None:
                self._write(exchange, now)
            elif exchange is self._fence:
                self._fence_failed()
            else:
                exchange.settle(refusal)

    def _next(self, now: float) -> Exchange | None:
        under_way = self._awaiting is not None or bool(self._stops)
        if self.interject_stops or not under_way:
            stop = self._scheduler.next((Lane.STOP,), self._not_under_way)
            if stop is not None:
                return stop
        if under_way:
            return None
        if self._out_of_step:
            return self._new_fence()
        if self._urgent:
            return self._urgent.popleft()
        if not self._ready:
            return None
        return self._interposed(self._scheduler.next((Lane.COMMAND, Lane.READ)), now)

    def _not_under_way(self, stop: Exchange) -> bool:
        return all(stop.key != other.key for other in self._stops)

    def _interposed(self, exchange: Exchange | None, now: float) -> Exchange | None:
        """Between two commands with equal replies goes a fence: no copy of the first reply counts twice."""
        while exchange is not None and exchange.abandoned():
            exchange = self._scheduler.next((Lane.COMMAND, Lane.READ))
        if exchange is None or exchange.key != self._last_command or exchange.command.may_repeat():
            return exchange
        if self.gate.refuses(exchange, now):
            return exchange
        self._scheduler.put_back(exchange)
        self._lose_step(exchange.body)
        return self._new_fence()

    def _port_takes_bytes(self, now: float) -> bool:
        """Whether everything written before has left; a port that stays blocked is opened anew."""
        if self.transport.unsent() == 0:
            self._stuck_since = None
            return True
        if self._stuck_since is None:
            self._stuck_since = now
        if now - self._stuck_since > STUCK_S:
            self._stuck_since = None
            self._went_down(f"{self.transport.address} takes no bytes")
        else:
            self._wake_at(now + 0.001)
        return False

    def _write(self, exchange: Exchange, now: float) -> None:
        try:
            self.transport.write(exchange.frame)
        except TransportLost as error:
            exchange.settle(
                LineDown(f"Line {self.id} is down: {error}. Nothing was sent.", "Check the cable.")
            )
            self._went_down(str(error))
            return
        self.counters["frames_sent"] += 1
        self._tx_free_at = now + len(exchange.frame) * self.transport.byte_time_s
        exchange.written_at = now
        exchange.deadline = self._tx_free_at + exchange.timeout_s
        if exchange.lane is Lane.STOP:
            self._stops.append(exchange)
        else:
            self._awaiting = exchange
            if exchange.lane is Lane.COMMAND:
                self._last_command = exchange.key
        self._wake_at(exchange.deadline)
        if exchange.on_written is not None:
            exchange.on_written(now)

    # reading

    def data_received(self, data: bytes) -> None:
        """Bytes from the port."""
        self._last_rx_at = self._loop.time()
        for frame in self._reader.feed(data):
            self._take(frame)

    def connection_lost(self, error: TransportLost) -> None:
        """The port has gone by itself."""
        self._went_down(str(error))

    def _take(self, frame: Frame) -> None:
        if isinstance(frame, Answer | Refusal | GroupAnswer):
            self._credit(frame)
        elif isinstance(frame, Garbage):
            self.counters["garbage"] += 1
            self._line_error(frame.why)
        else:
            self.counters["messages"] += 1
            self.on_message(frame)

    def _credit(self, frame: Answer | Refusal | GroupAnswer) -> None:
        """Give a reply to the exchange it answers; the next frame goes out before anybody is told."""
        for exchange in (*([self._awaiting] if self._awaiting else []), *self._stops):
            outcome = exchange.credit(frame, self._last_rx_at)
            if outcome is not None:
                self._last_frame = frame
                self.counters["replies"] += 1
                return self._answered(exchange, outcome)
        suspect = self._suspect
        if suspect is not None and suspect.late_answer is None:
            outcome = suspect.credit(frame, self._last_rx_at)
            if outcome is not None:
                self.counters["late_replies"] += 1
                suspect.late_answer = outcome if isinstance(outcome, Refusal) else _late(outcome)
                return None
        self.counters["duplicates" if frame == self._last_frame else "strays"] += 1
        return self._line_error("the reply to another command")

    def _answered(self, exchange: Exchange, outcome: Answered | Refusal) -> None:
        if exchange in self._stops:
            self._stops.remove(exchange)
        else:
            self._awaiting = None
        if exchange.self_identifying:
            self._last_command = None
        if exchange is self._fence:
            self._fence_passed()
        elif exchange.body in self.offline:
            self._came_back(exchange.body)
        self._pump()
        exchange.settle(outcome)

    def _line_error(self, what: str) -> None:
        """Something arrived that nobody can have wanted: whatever is awaited may have been it.

        A fence waits on: noise must not use up its tries, and its own reply cannot be mistaken.
        """
        self.last_error_at = self._last_rx_at
        exchange = self._awaiting
        if exchange is not None and not exchange.self_identifying:
            self._doubt(exchange, GarbledReply(_sent(exchange, f"{what} came back"), _remedy(exchange)))
        self._pump()

    # time

    def _wake_at(self, at: float) -> None:
        """Keep one timer, at the earliest moment anything is due."""
        if self._timer is not None:
            if self._timer.when() <= at:
                return
            self._timer.cancel()
        self._timer = self._loop.call_at(at, self._wake)

    def _wake(self) -> None:
        self._timer = None
        now = self._loop.time()
        for exchange in (*([self._awaiting] if self._awaiting else []), *self._stops):
            if exchange.deadline is not None and exchange.deadline <= now:
                self._overdue(exchange, now)
        deadlines = [it.deadline for it in (self._awaiting, *self._stops) if it and it.deadline is not None]
        if deadlines:
            self._wake_at(min(deadlines))
        self._pump()

    def _overdue(self, exchange: Exchange, now: float) -> None:
        given_up_at = (exchange.written_at or now) + exchange.timeout_s + self.late_reply_s
        resumes_at = min(self._last_rx_at + GAP_S, given_up_at)
        if self._reader.pending() and now < resumes_at:
            exchange.deadline = resumes_at
            return
        self.counters["timeouts"] += 1
        self.last_error_at = now
        self._doubt(exchange, NoReply(_sent(exchange, "no reply came"), _remedy(exchange)))

    # doubt and certainty

    def _doubt(self, exchange: Exchange, reason: NoReply) -> None:
        """An exchange has no usable reply: fence the line before its outcome is told."""
        if exchange.lane is Lane.STOP:
            if exchange in self._stops:
                self._stops.remove(exchange)
            exchange.settle(reason)
            return
        self._awaiting = None
        if exchange is self._fence:
            self._fence_failed()
        elif exchange.self_identifying:
            exchange.settle(reason)
        else:
            exchange.doubt = reason
            self._suspect = exchange
            self._lose_step(exchange.body)

    def _lose_step(self, body: int) -> None:
        """From now on nothing but stops is sent until a fence has passed."""
        self._out_of_step = True
        self._fence_body, self._fence_tries = self._fence_target(body), 0

    def _fence_target(self, body: int) -> int:
        """Whom to ask for proof: the body itself, or one that stands for the group or the link master."""
        if body <= LAST_BODY:
            return body
        candidates = self.groups.get(body) or self.bodies
        return next((it for it in candidates if it not in self.offline), candidates[0] if candidates else 0)

    def _new_fence(self) -> Exchange:
        self._fence = self._nonce_read(self._fence_body)
        self._fence.timeout_s = max(self.reply_timeout_s, self.late_reply_s / FENCE_TRIES)
        self.counters["fences"] += 1
        return self._fence

    def _fence_passed(self) -> None:
        self._fence = None
        if self._fence_body in self.offline:
            self._came_back(self._fence_body)
        self._regain_step()

    def _fence_failed(self) -> None:
        self._fence = None
        self._fence_tries += 1
        if self._fence_tries < FENCE_TRIES:
            return
        self._went_offline(self._fence_body)
        alive = [body for body in self.bodies if body not in self.offline]
        if alive:
            self._fence_body, self._fence_tries = alive[0], 0
        else:
            # Late replies have had their time; the probes tell when somebody is back.
            self._last_command = None
            if self._suspect is not None:
                self._suspect.repeats = 0
            self._regain_step()

    def _regain_step(self) -> None:
        self._out_of_step = False
        suspect, self._suspect = self._suspect, None
        if suspect is not None:
            self._resolve(suspect)

    def _resolve(self, exchange: Exchange) -> None:
        if exchange.late_answer is not None:
            exchange.settle(exchange.late_answer)
        elif exchange.repeats > 0 and not exchange.abandoned() and exchange.body not in self.offline:
            exchange.repeats -= 1
            self.counters["repeats"] += 1
            if exchange.lane is Lane.READ:
                self._scheduler.put_back(exchange)
            else:
                self._urgent.appendleft(exchange)
        elif exchange.doubt is not None:
            exchange.settle(exchange.doubt)

    # presence

    def _went_offline(self, body: int) -> None:
        if body in self.offline:
            return
        self.offline.add(body)
        why = BodyOffline(f"Body {body:02X} does not answer; nothing was sent.", "Check its power and cable.")
        self.cancel(lambda it: it.body == body and it.lane is not Lane.STOP and not it.self_identifying, why)
        self.on_change("body.offline", {"body": body})

    def _came_back(self, body: int) -> None:
        self.offline.discard(body)
        self.on_change("body.online", {"body": body})
        if len(self.offline) == len(self.bodies) - 1:
            self.set_up_again("the line was silent and answers again")

    async def _probe_offline(self) -> None:
        """Ask the bodies that went silent, less and less often, whether they are back."""
        pause_s = PROBE_S[0]
        while True:
            await asyncio.sleep(pause_s)
            for body in sorted(self.offline):
                outcome = await self.probe(body, self.reply_timeout_s)
                if isinstance(outcome, Answered):
                    pause_s = PROBE_S[0]
            pause_s = min(2 * pause_s, PROBE_S[1]) if self.offline else PROBE_S[0]


def _group_definition(group: int, members: list[int]) -> SetGroup:
    return SetGroup(group=f"{group:02X}", members=[f"{member:02X}" for member in members])


def _sent(exchange: Exchange, what: str) -> str:
    return f"{exchange.command.code} was sent to body {exchange.body:02X}, and {what}."


def _remedy(exchange: Exchange) -> str:
    return "Ask again." if exchange.command.may_repeat() else "Read status and position before anything else."


def _late(outcome: Answered) -> Answered:
    return Answered(outcome.replies, outcome.at, late=True)


def lane_of(command: RorzeCommand[Any]) -> Lane:
    """The lane a command belongs to by its nature."""
    return {Retry.STOP: Lane.STOP, Retry.READ: Lane.READ}.get(command.retry, Lane.COMMAND)
