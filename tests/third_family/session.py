"""The parts that a toy axis needs beside the core: crediting of its replies, and the set-up of its line."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from gateway.core.errors import GatewayError
from gateway.core.exchange import STOPS, Exchange, Lane, RememberedReply
from gateway.core.line import LineDriver
from gateway.core.session import READ_REPEATS, Session
from protocols.table import Reply, WireFault
from tests.third_family.rows import REFUSED, Frame, Frames, GetStatus, Status, ToyCommand
from transports.base import Transport

AXIS, SET_UP = 0, 1


class ToyRefused(GatewayError):
    """The axis has refused a command: nothing moved."""

    kind = "controller-refused"


@dataclass(eq=False, slots=True)
class ToyExchange(Exchange[ToyCommand[Any], Frame, Reply | GatewayError]):
    """A command to an axis; its reply has its number."""

    serial: int = 0

    def credit(self, frame: Frame, _: float = 0.0) -> Reply | GatewayError | None:
        if frame.number != self.serial:
            return None
        if frame.code == REFUSED:
            return ToyRefused(f"The axis refused {self.command.name()}; nothing moved.")
        try:
            reply: Reply = self.command.read_reply(frame.data)
        except WireFault:
            return None
        return reply

    def mistakes(self, _: RememberedReply) -> bool:
        return False


class ToySession(Session[ToyExchange, Frame]):
    """The exchanges with one axis."""

    last = 0
    """The number of the last command."""

    def exchange(self, command: ToyCommand[Any], lane: Lane, target: int = AXIS) -> ToyExchange:
        self.last = number = (self.last + 1) % 0x10000
        repeats, timeout_s = READ_REPEATS if command.may_repeat else 0, self.terms.reply_timeout_s
        exchange = ToyExchange(
            command, command.frame(number), lane, target, self.epoch(target), serial=number
        )
        exchange.reply.timeout_s, exchange.reply.repeats = timeout_s, repeats
        return exchange

    def fence_query(self) -> ToyExchange:
        fence = self.exchange(GetStatus(), Lane.VERIFY)
        fence.reply.self_identifying = True
        return fence


class ToyLine(LineDriver[ToyExchange, Frame, Frame]):
    """A port with one axis."""

    def __init__(self, line_id: str, port: Transport, timeouts_s: tuple[float, float]) -> None:
        reply_s, late_s = timeouts_s
        self.numbers = session = ToySession(
            target="axis",
            set_up_target=SET_UP,
            replies_remembered=8,
            reply_timeout_s=reply_s,
            late_reply_s=late_s,
        )
        super().__init__(line_id, port, session, Frames)
        session.on_silence = lambda: self.set_up_again("the axis is silent")

    async def _set_up(self, *, fresh: bool) -> None:
        """Go on with the numbers behind the newest motion, for an axis takes only newer ones."""
        self._begins_set_up()
        while self._life.is_open:
            told = await self._say_first(self.numbers.exchange(GetStatus(), Lane.COMMAND, SET_UP))
            if isinstance(told, Status):
                self.numbers.last = max(self.numbers.last, told.newest)
                self._came_up({})
                break
            self._is_silent("the axis does not answer")
            self.cancel(lambda exchange: exchange.lane not in STOPS, self._down())
            await asyncio.sleep(self.reply_timeout_s)
        self._pump()

    async def ask(
        self, command: Any, lane: Lane = Lane.READ, on_written: Callable[[float], None] | None = None
    ) -> Any:
        """Send a command, and give its reply; errors as of `reply_to`."""
        exchange = self.numbers.exchange(command, lane)
        exchange.on_written = on_written
        return await self.reply_to(exchange)
