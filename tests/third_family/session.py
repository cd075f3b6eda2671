"""What is said to a toy axis: one command at a time, and a fence after every answer that stayed away."""

import asyncio
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count
from typing import Any

from gateway.core.carrier import Carrier
from gateway.core.errors import Cancelled, GatewayError, NoReply, Overtaking, StoppedFirst
from gateway.core.lanes import Lane
from gateway.core.port import LineState
from protocols.lines import Lines
from protocols.table import Reply, WireFault
from tests.third_family.rows import Echo, ToyCommand
from transports.base import Transport

Outcome = Reply | GatewayError


@dataclass(eq=False)
class Exchange:
    """A command on its way."""

    command: ToyCommand
    lane: Lane
    timeout_s: float = 0.2
    on_written: Callable[[float], None] = lambda _: None
    outcome: "asyncio.Future[Outcome]" = field(
        default_factory=lambda: asyncio.get_running_loop().create_future()
    )

    @property
    def frame(self) -> bytes:
        text = f"{self.command.code} {self.command.written()}"
        return f"{text.rstrip()}\r".encode("ascii")

    def settle(self, outcome: Outcome) -> None:
        if not self.outcome.done():
            self.outcome.set_result(outcome)


class Session:
    """No clock and no port."""

    def __init__(self) -> None:
        self.counters: Counter[str] = Counter()
        self.queue: deque[Exchange] = deque()
        self.in_step = True
        self._numbers = count(1)
        self._under_way: Exchange | None = None
        self._deadline: float | None = None

    def submit(self, exchange: Exchange) -> None:
        if exchange.lane is Lane.STOP:
            self.revoke(StoppedFirst)
            self.queue.appendleft(exchange)
        else:
            self.queue.append(exchange)

    def revoke(self, why: Overtaking) -> None:
        for exchange in [it for it in self.queue if it.lane is Lane.COMMAND]:
            self.queue.remove(exchange)
            exchange.settle(why())

    def fence(self) -> None:
        self.in_step = False

    def has_something(self) -> bool:
        return bool(self.queue) or not self.in_step

    def next(self, now: float, *, ready: bool) -> Exchange | None:
        """Take a stop at once, a fence before all else, and nothing else while an answer is due."""
        if self.queue and self.queue[0].lane is Lane.STOP:
            return self.queue.popleft()
        if self._under_way is not None or not ready:
            return None
        if not self.in_step:
            return Exchange(Echo(number=next(self._numbers)), Lane.PROOF)
        return self.queue.popleft() if self.queue else None

    def written(self, exchange: Exchange, now: float, deadline: float) -> None:
        if self._under_way is not None:
            self._under_way.settle(NoReply("A stop went first.", "Look again.", self._under_way.command))
            self.fence()
        self._under_way, self._deadline = exchange, deadline
        exchange.on_written(now)

    def deadline(self) -> float | None:
        return self._deadline

    def pass_deadlines(self, now: float, _: float | None) -> None:
        if self._under_way is not None and self._deadline is not None and now >= self._deadline:
            late, self._under_way, self._deadline = self._under_way, None, None
            self.fence()
            self.counters["timeouts"] += 1
            late.settle(NoReply("The axis did not answer.", "Look again.", late.command))

    def heard(self, line: str) -> None:
        """Credit an answer to the command it can only belong to."""
        exchange, (code, _, text) = self._under_way, line.partition(" ")
        reply: Outcome = Cancelled(f"The axis refused {code}; nothing moved.")
        if exchange is None or code != exchange.command.code:
            self.counters["strays"] += 1
            return
        if text != "no":
            try:
                reply = exchange.command.read_reply(text)
            except WireFault:
                self.counters["strays"] += 1
                return
        self._under_way = self._deadline = None
        if isinstance(exchange.command, Echo):
            self.in_step = True
            self.counters["fences"] += 1
        exchange.settle(reply)

    def break_off(self, why: GatewayError) -> None:
        for exchange in (self._under_way, *self.queue):
            if exchange is not None:
                exchange.settle(why)
        self._under_way = self._deadline = None
        self.queue.clear()
        self.fence()


class _Reader:
    def __init__(self) -> None:
        self._lines = Lines(60)

    def feed(self, data: bytes, /) -> list[str]:
        return [line.decode("ascii", "replace") for line in self._lines.feed(data)]

    def pending(self) -> int:
        return self._lines.pending()


class ToyLine(Carrier[Exchange, str]):
    """A port with one axis."""

    _talk: Session

    def __init__(self, line_id: str, transport: Transport) -> None:
        super().__init__(line_id, transport, Session(), _Reader())

    async def _set_up(self, *, fresh: bool) -> None:
        self._ready = True
        self._talk.fence()
        self._came_up({})
        self._pump()

    def _break_off(self, reason: str) -> None:
        self._talk.break_off(Cancelled(f"Line {self.id} went down: {reason}; nothing was sent."))

    def _take(self, frame: str) -> None:
        self._talk.heard(frame)
        self._pump()

    def waiting(self) -> dict[str, int]:
        return {lane.name.lower(): sum(it.lane is lane for it in self._talk.queue) for lane in Lane}

    async def ask(
        self, command: Any, lane: Lane = Lane.READ, on_written: Callable[[float], None] = lambda _: None
    ) -> Any:
        """Send a command, and give its reply.

        :raises GatewayError: there was none.
        """
        if lane is Lane.COMMAND:
            self.admission.require()
        if self.state is LineState.DOWN:
            raise self._down()
        exchange = Exchange(command, lane, on_written=on_written)
        self._talk.submit(exchange)
        self._pump()
        outcome = await exchange.outcome
        if isinstance(outcome, GatewayError):
            raise outcome
        return outcome
