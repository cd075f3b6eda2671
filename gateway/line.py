"""One port with its RC-400: keeps it open and set up, and carries the conversation over it in time."""

import asyncio
import logging
import random
from collections.abc import Callable, Iterable
from enum import StrEnum
from typing import Any

from gateway.conversation import Conversation, offline_error
from gateway.errors import Cancelled, ControllerRefused, GatewayError, LineDown, NoReply
from gateway.exchange import Answered, Exchange, Lane, Outcome
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
)
from protocols.rorze.link_master import IdentifyControllers, SetGroup, SetReplyFormat
from protocols.rorze.row import LINK_MASTER, RorzeCommand
from protocols.table import Retry
from transports.base import Transport, TransportError, TransportLost

log = logging.getLogger(__name__)

REPLIES = Answer, Refusal, GroupAnswer

SILENCE_S = 0.05
"""The line must be quiet this long after the poison of an opening."""
GAP_S = 0.1
"""A reply that has begun may pause this long before it counts as cut off."""
STUCK_S = 1.0
"""The port must take our bytes within this time, or it is opened anew."""
REOPEN_S = (0.2, 5.0)
"""First and longest pause before a lost port is tried again; it doubles in between."""
PROBE_S = (1.0, 10.0)
"""First and longest pause between probes of the bodies that do not answer."""
PROBE_SHARE = 0.1
"""Share of the line's time that probes may take while anybody else answers."""


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
        self.controllers = ""
        """What the link master answered to XID."""
        self.down_reason = "not opened yet"
        self.on_message: Callable[[MoveEnded | StatusChanged | UnknownMessage], None] = lambda _: None
        self.on_change: Callable[[str, dict[str, object]], None] = lambda _what, _facts: None
        self._talk = Conversation(
            bodies,
            introducer=introducer,
            reply_timeout_s=reply_timeout_s,
            late_reply_s=late_reply_s,
            interject_stops=interject_stops,
            rng=rng,
        )
        self._talk.on_presence = self._presence_changed
        self.bodies, self.groups, self.offline = self._talk.bodies, self._talk.groups, self._talk.offline
        self.gate, self.counters = self._talk.gate, self._talk.counters
        self.introducer, self.interject_stops = introducer, interject_stops
        self.reply_timeout_s, self.late_reply_s = reply_timeout_s, late_reply_s
        self._reader = LinkReader()
        self._open = False
        self._ready = False
        self._tx_free_at = 0.0
        self._last_rx_at = 0.0
        self._stuck_since: float | None = None
        self._timer: asyncio.Handle | None = None
        self._timer_at = 0.0
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
        return LineState.READY if self._talk.in_step else LineState.OUT_OF_STEP

    @property
    def last_error_at(self) -> float | None:
        """When a reply was last missing or garbled, in the event loop's time."""
        return self._talk.last_error_at

    def waiting(self) -> dict[str, int]:
        """How many exchanges wait in each lane."""
        return {lane.name.lower(): self._talk.scheduler.waiting(lane) for lane in Lane}

    def frame_of(self, body: int, command: RorzeCommand[Any]) -> str:
        """Show the exact frame of a command as text, with its CR escaped."""
        return self._talk.frame_of(body, command).decode("ascii").replace("\r", "\\r")

    def can_address(self, body: int) -> bool:
        """Whether the line's way of addressing reaches this body number."""
        return self.introducer == "&" or body <= 0xF

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

    def _went_down(self, reason: str) -> None:
        was_open, self._open, self._ready = self._open, False, False
        changed = was_open or reason != self.down_reason
        self.down_reason = reason
        self._reader = LinkReader()
        self._stuck_since = None
        self._talk.break_off(
            NoReply(f"Line {self.id} was lost before the reply came: {reason}.", "Read status and position."),
            Cancelled(f"Line {self.id} went down: {reason}. Nothing was sent.", "Try again later."),
        )
        if changed:
            self.on_change("line.down", {"reason": reason})
        self._attention.set()

    # set-up

    async def _set_up(self, *, fresh: bool) -> None:
        """Tell the link master what it forgets at power-off: XID, XRSM1, the groups (RC-420 manual 17.2)."""
        self._ready = False
        if fresh:
            await self._poison()
        identified = await self._tell(IdentifyControllers())
        if isinstance(identified, Answered):
            self.controllers = getattr(identified.replies[LINK_MASTER], "text", "")
        await self._tell(SetReplyFormat(end_of_move=1))
        for group, members in list(self.groups.items()):
            await self._tell(_group_definition(group, members))
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

    async def _tell(self, command: RorzeCommand[Any]) -> Outcome:
        """Send the link master a command ahead of everything but stops and fences."""
        if not self._open:
            return self._down()
        exchange = self._talk.exchange(LINK_MASTER, command, Lane.COMMAND)
        future = self._promise(exchange)
        self._talk.put_first(exchange)
        self._pump()
        return await future

    def set_up_again(self, reason: str) -> None:
        """The link master shows signs of a restart: tell it everything again."""
        log.warning("line %s: %s; setting the link master up again", self.id, reason)
        self.counters["set_ups_again"] += 1
        self._set_up_due = True
        self._attention.set()

    async def define_group(self, group: int, members: list[int]) -> None:
        """Define a virtual body at the link master, now and after every restart of it.

        :raises GatewayError: the link master did not take it; the old definition holds, or is sent again
            where nobody knows.
        """
        outcome = await self.submit(LINK_MASTER, _group_definition(group, members), Lane.COMMAND)
        if isinstance(outcome, Refusal):
            raise ControllerRefused(f"{self.id}.7F", outcome.code, outcome.error)
        if isinstance(outcome, GatewayError):
            if isinstance(outcome, NoReply):
                self.set_up_again(f"nobody knows what group {group:02X} is now")
            raise outcome
        self.groups[group] = members

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
            raise self._down()
        if body in self.offline and lane is not Lane.STOP:
            raise offline_error(body)
        exchange = self._talk.exchange(body, command, lane)
        exchange.expires_at, exchange.on_written = expires_at, on_written
        future = self._promise(exchange)
        self._talk.scheduler.submit(exchange)
        if expires_at is not None:
            self._loop.call_at(expires_at, self._expire)
        self._pump()
        return future

    def probe(self, body: int, timeout_s: float) -> "asyncio.Future[Outcome]":
        """Ask a body, known or not, whether it is there, by a read that nothing else can be mistaken for."""
        exchange = self._talk.self_identifying_read(body)
        exchange.timeout_s = timeout_s
        future = self._promise(exchange)
        if self._open:
            self._talk.scheduler.submit(exchange)
            self._pump()
        else:
            exchange.settle(self._down())
        return future

    def cancel(self, unwanted: Callable[[Exchange], bool], reason: GatewayError) -> None:
        """Take out of the queue what is not wanted any more."""
        self._talk.cancel(unwanted, reason)

    def _promise(self, exchange: Exchange) -> "asyncio.Future[Outcome]":
        future: asyncio.Future[Outcome] = self._loop.create_future()
        exchange.waiters.append(future)
        return future

    def _down(self) -> LineDown:
        return LineDown(f"Line {self.id} is down: {self.down_reason}. Nothing was sent.", "Check the cable.")

    def _expire(self) -> None:
        self._talk.scheduler.expire(self._loop.time())

    # writing

    def _pump(self) -> None:
        """Write whatever may go now; a frame at a time, so that a stop leaves at the next frame boundary."""
        while self._open and self._talk.has_something():
            now = self._loop.time()
            if now < self._tx_free_at:
                self._wake_at(self._tx_free_at)
                return
            if not self._port_takes_bytes(now):
                return
            exchange = self._talk.next(now, ready=self._ready)
            if exchange is None:
                return
            self._write(exchange, now)

    def _port_takes_bytes(self, now: float) -> bool:
        """Whether everything written before has left; a port that stays blocked is opened anew."""
        if self.transport.unsent() == 0:
            self._stuck_since = None
            return True
        if self._stuck_since is None:
            self._stuck_since = now
        if now - self._stuck_since > STUCK_S:
            self._went_down(f"{self.transport.address} takes no bytes")
        else:
            self._wake_at(now + 0.001)
        return False

    def _write(self, exchange: Exchange, now: float) -> None:
        try:
            self.transport.write(exchange.frame)
        except TransportLost as error:
            self._went_down(str(error))
            exchange.settle(self._down())
            return
        self._tx_free_at = now + len(exchange.frame) * self.transport.byte_time_s
        deadline = self._tx_free_at + exchange.timeout_s
        self._talk.written(exchange, now, deadline)
        self._wake_at(deadline)

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
        """Hear a frame; the next one goes out before anybody is told what the reply was."""
        if isinstance(frame, REPLIES):
            tell = self._talk.heard(frame, self._last_rx_at)
            self._pump()
            if tell is not None:
                tell()
        elif isinstance(frame, Garbage):
            self.counters["garbage"] += 1
            self._talk.noise(frame.why, self._last_rx_at)
            self._pump()
        else:
            self.counters["messages"] += 1
            self.on_message(frame)

    # time

    def _wake_at(self, at: float) -> None:
        """Keep one timer, at the earliest moment anything is due."""
        if self._timer is not None:
            if self._timer_at <= at:
                return
            self._timer.cancel()
        # Kept beside the handle: uvloop's handles of timers that are due at once do not tell their time.
        self._timer, self._timer_at = self._loop.call_at(at, self._wake), at

    def _wake(self) -> None:
        self._timer = None
        resumes_at = self._last_rx_at + GAP_S if self._reader.pending() else None
        self._talk.pass_deadlines(self._loop.time(), resumes_at)
        deadline = self._talk.deadline()
        if deadline is not None:
            self._wake_at(deadline)
        self._pump()

    # presence

    def _presence_changed(self, body: int, here: bool) -> None:
        self.on_change("body.online" if here else "body.offline", {"body": body})
        if here and len(self.offline) == len(self.bodies) - 1:
            self.set_up_again("the line was silent and answers again")

    async def _probe_offline(self) -> None:
        """Ask the bodies that went silent, less and less often, whether they are back."""
        pause_s = PROBE_S[0]
        while True:
            await asyncio.sleep(pause_s)
            somebody_came_back = await self._probe_each()
            nobody_is_disturbed = len(self.offline) in (0, len(self.bodies))
            often = somebody_came_back or nobody_is_disturbed
            pause_s = PROBE_S[0] if often else min(2 * pause_s, PROBE_S[1])

    async def _probe_each(self) -> bool:
        """One round of probes, in a small share of the line's time while anybody else answers."""
        somebody_came_back = False
        for body in sorted(self.offline):
            began_at = self._loop.time()
            outcome = await self.probe(body, self.reply_timeout_s)
            if isinstance(outcome, Answered):
                somebody_came_back = True
            elif len(self.offline) < len(self.bodies):
                await asyncio.sleep((self._loop.time() - began_at) / PROBE_SHARE)
        return somebody_came_back


def _group_definition(group: int, members: list[int]) -> SetGroup:
    return SetGroup(group=f"{group:02X}", members=[f"{member:02X}" for member in members])


_LANES = {Retry.STOP: Lane.STOP, Retry.READ: Lane.READ}


def lane_of(command: RorzeCommand[Any]) -> Lane:
    """The lane a command belongs to by its nature."""
    return _LANES.get(command.retry, Lane.COMMAND)
