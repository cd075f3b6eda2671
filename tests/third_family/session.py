"""What a toy axis needs beside the core: how its answers are read, and what its fence is."""

from collections.abc import Callable
from itertools import cycle
from typing import Any

from gateway.core.errors import Cancelled, GatewayError, StoppedFirst
from gateway.core.exchange import Exchange, Said
from gateway.core.lanes import Lane
from gateway.core.line import LineDriver
from gateway.core.line_state import LineState
from gateway.core.session import READ_REPEATS, Session
from protocols.lines import Lines
from protocols.table import Reply, WireFault
from tests.third_family.rows import Echo, ToyCommand
from transports.base import Transport

REPLY_WITHIN_S = 0.2
LATE_S = 0.3
AXIS, SET_UP = 0, 1


class ToyExchange(Exchange[ToyCommand, str, Reply | GatewayError]):
    """A command to an axis."""

    def credit(self, frame: str, now: float) -> Reply | GatewayError | None:
        code, _, text = frame.partition(" ")
        if code != self.command.code:
            return None
        if text == "no":
            return Cancelled(f"The axis refused {code}; nothing moved.")
        try:
            reply: Reply = self.command.read_reply(text)
        except WireFault:
            return None
        return reply

    @property
    def sent(self) -> str:
        return f"{self.command.code} was sent to the axis"

    def mistakes(self, said: Said) -> bool:
        return False  # this axis says nothing twice


class ToySession(Session[ToyExchange, str]):
    """The exchanges with one axis."""

    def __init__(self) -> None:
        super().__init__(
            target="axis",
            set_up_target=SET_UP,
            replies_remembered=8,
            reply_timeout_s=REPLY_WITHIN_S,
            late_reply_s=LATE_S,
        )
        self._numbers = cycle(range(1, 1000))
        self.on_silence: Callable[[], None] = lambda: None

    def exchange(self, command: ToyCommand, lane: Lane) -> ToyExchange:
        frame = f"{command.code} {command.written()}".rstrip() + "\r"
        return ToyExchange(
            command,
            frame.encode("ascii"),
            lane,
            epoch=self.epoch(AXIS),
            timeout_s=self.reply_timeout_s,
            repeats=READ_REPEATS if command.may_repeat() else 0,
        )

    def fence_query(self) -> ToyExchange:
        return self.exchange(Echo(number=next(self._numbers)), Lane.VERIFY)

    def wants_fence(self, exchange: ToyExchange, now: float) -> bool:
        return False

    def holds_up(self, sent: ToyExchange) -> bool:
        return False

    def witness_failed(self) -> bool:
        self.on_silence()
        return False

    def is_refusal_of_fence(self, frame: str) -> bool:
        return False


class _Reader(Lines):
    def __init__(self) -> None:
        super().__init__(60)

    def feed(self, data: bytes, /) -> list[str]:  # type: ignore[override]  # text
        return [line.decode("ascii", "replace") for line in super().feed(data)]


class ToyLine(LineDriver[ToyExchange, str, str]):
    """A port with one axis."""

    _session: ToySession

    def __init__(self, line_id: str, transport: Transport) -> None:
        super().__init__(line_id, transport, session := ToySession(), _Reader)
        session.on_silence = lambda: self.set_up_again("the axis is silent")

    async def _set_up(self, *, fresh: bool) -> None:
        self._came_up({})
        self.fence()
        self._pump()

    def _break_off(self, reason: str) -> None:
        self._break_off_all(reason, "Look again.")

    def _take(self, frame: str) -> None:
        self._receive(frame)

    def begin_stop(self) -> None:
        """Forbid what waits."""
        self.gate.stop(AXIS)
        self.cancel(lambda it: it.lane is Lane.COMMAND, StoppedFirst())

    async def ask(
        self, command: Any, lane: Lane = Lane.READ, on_written: Callable[[float], None] | None = None
    ) -> Any:
        """Send a command, and give its reply.

        :raises GatewayError: there was none.
        """
        if lane is Lane.COMMAND:
            self.admission.require()
        if self.state is LineState.DOWN:
            raise self._down()
        exchange = self._session.exchange(command, lane)
        exchange.on_written = on_written
        outcome = await self._queue(exchange)
        if isinstance(outcome, GatewayError):
            raise outcome
        return outcome
