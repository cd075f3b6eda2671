"""A conversation carried over its port: what may go is written, what comes is cut into frames and heard."""

from abc import abstractmethod
from collections import Counter
from typing import Generic, Protocol, TypeVar

from gateway.core.errors import GatewayError, InvalidRequest, Overtaking
from gateway.core.origin import Origin, acting
from gateway.core.port import PortLoop
from transports.base import Transport, TransportRefused

GAP_S = 0.1
"""A reply that has begun may pause this long before it counts as cut off."""


class Writable(Protocol):
    """An exchange, as far as its port is concerned."""

    @property
    def frame(self) -> bytes:
        """What is written."""

    @property
    def timeout_s(self) -> float:
        """From the frame's last bit to the reply's deadline."""

    @property
    def origin(self) -> Origin:
        """On whose behalf it is sent."""

    def settle(self, outcome: GatewayError, /) -> None:
        """Tell everybody who still waits."""


X = TypeVar("X", bound=Writable)
F = TypeVar("F")


class Talk(Protocol[X]):
    """What is said on a line, without clock and port; the same for every protocol."""

    counters: Counter[str]
    in_step: bool

    def revoke(self, why: Overtaking) -> None:
        """Write no command that was admitted before now."""

    def fence(self) -> None:
        """Prove anew that no earlier reply is still to come."""

    def has_something(self) -> bool:
        """Whether anything could go; asked first, because it costs less than asking the port."""

    def next(self, now: float, *, ready: bool) -> X | None:
        """Take the exchange that is to be written now; None if none may go."""

    def written(self, exchange: X, now: float, deadline: float) -> None:
        """Note that the frame has been handed to the port, and until when its reply is waited for."""

    def deadline(self) -> float | None:
        """When the next reply is overdue."""

    def pass_deadlines(self, now: float, resumes_at: float | None) -> None:
        """Give up waiting for what is overdue; `resumes_at` is set while a reply has begun and may go on."""


class Reader(Protocol[F]):
    """Cuts what comes into frames."""

    def feed(self, data: bytes, /) -> list[F]:
        """Take bytes, give the frames that are complete now."""

    def pending(self) -> int:
        """Bytes of a frame that has begun and not ended."""


class Carrier(PortLoop, Generic[X, F]):
    """A port with what is said on it."""

    _talk: Talk[X]
    _reader: Reader[F]

    def __init__(self, line_id: str, transport: Transport, talk: Talk[X], reader: Reader[F]) -> None:
        super().__init__(line_id, transport, talk.counters)
        self._talk, self._reader = talk, reader

    @abstractmethod
    def _take(self, frame: F) -> None:
        """Hear a frame, let the next one go, and only then tell what was heard."""

    def _in_step(self) -> bool:
        return self._talk.in_step

    def revoke(self, why: Overtaking) -> None:
        """Send no command that was admitted before now and is not written yet."""
        self._talk.revoke(why)

    def fence(self) -> None:
        """Let nothing but stops go before it is proved that no earlier reply is still to come."""
        if self._ready:
            self._talk.fence()
            self._loop.call_soon(self._pump)

    def _pump(self) -> None:
        """Write whatever may go now; a frame at a time, so that a stop leaves at the next frame boundary."""
        while self._open and self._has_something():
            now = self._loop.time()
            if not self._port_is_free(now):
                return
            exchange = self._talk.next(now, ready=self._ready)
            if exchange is None:
                return
            self._write(exchange, now)

    def _has_something(self) -> bool:
        """Whether anything could go that was not asked for before a suspension."""
        if not self._talk.has_something():
            return False
        self.admission.revise()
        return self._talk.has_something()

    def _write(self, exchange: X, now: float) -> None:
        with acting(exchange.origin):
            self._write_in_its_name(exchange, now)

    def _write_in_its_name(self, exchange: X, now: float) -> None:
        try:
            written = self._send(exchange.frame, now)
        except TransportRefused as error:
            exchange.settle(InvalidRequest(f"{error} Nothing was sent.", "Send less at once."))
            return
        if not written:
            exchange.settle(self._down())
            return
        deadline = self._tx_free_at + exchange.timeout_s
        self._talk.written(exchange, now, deadline)
        self._wake_at(deadline)

    def data_received(self, data: bytes) -> None:
        """Bytes from the port."""
        self._last_rx_at = self._loop.time()
        for frame in self._reader.feed(data):
            self._take(frame)

    def _pass_deadlines(self, now: float) -> float | None:
        resumes_at = self._last_rx_at + GAP_S if self._reader.pending() else None
        self._talk.pass_deadlines(now, resumes_at)
        return self._talk.deadline()
