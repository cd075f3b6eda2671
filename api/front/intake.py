"""The event loop's time for the bytes of clients: a budget for each connection, and one for all."""

import asyncio
from collections import deque
from collections.abc import Callable
from time import monotonic
from typing import Final

from api.front.connections import LINGER_BYTES, ConnectionLimits
from api.front.turnstile import Turnstile, after_pause

SECOND: Final = 1.0


class Intake:
    """Parses the bytes of all connections, in each turn of the loop for a millisecond or so.

    A connection that used up its part goes to the end of a queue, and is not read meanwhile. One that did not
    goes first: however many connections send all they can, a request of another is read in the next turns.
    """

    def __init__(
        self, limits: ConnectionLimits, turnstile: Turnstile, clock: Callable[[], float] = monotonic
    ) -> None:
        self._limits = limits
        self._turnstile = turnstile
        self._clock = clock
        self._used_s = 0.0
        """Seconds used in this turn."""
        self._turning = False
        self._light: deque[Inlet] = deque()
        self._heavy: deque[Inlet] = deque()
        self._pauses = False
        """True while heavy connections give way to a stop."""

    def enter(self, inlet: "Inlet") -> None:
        """Parse what a connection has sent, now or in a later turn."""
        if not self._turning:
            self._turning = True
            self._used_s = 0.0
            asyncio.get_running_loop().call_soon(self._turn)
        if self._has_time() and not self._light:
            self._serve(inlet)
        else:
            inlet.wait_in(self._light)

    def _turn(self) -> None:
        self._used_s = 0.0
        self._serve_from(self._light)
        if self._heavy and not self._turnstile.stops:
            self._serve_from(self._heavy)
        elif self._heavy and not self._pauses:  # those that send all they can give way to a stop
            self._pauses = True
            after_pause(self._serve_heavy)
        waits = self._heavy and not self._pauses
        self._turning = bool(self._used_s or self._light or waits)
        if self._turning:
            asyncio.get_running_loop().call_soon(self._turn)

    def _serve_heavy(self) -> None:
        self._pauses = False
        self._serve_from(self._heavy)
        if not self._turning:
            self._turning = True
            asyncio.get_running_loop().call_soon(self._turn)

    def _has_time(self) -> bool:
        """Tell if time is left in this turn; there is less while a stop is under way."""
        limits = self._limits
        return self._used_s < (limits.connection_s if self._turnstile.stops else limits.turn_s)

    def _serve_from(self, queue: "deque[Inlet]") -> None:
        """Serve one at least, so that none waits for ever."""
        for _ in range(len(queue)):
            self._serve(queue.popleft())
            if not self._has_time():
                break

    def _serve(self, inlet: "Inlet") -> None:
        begun_at = self._clock()
        inlet.parse_until(begun_at + self._limits.connection_s, self._clock)
        self._used_s += self._clock() - begun_at
        if inlet.unread:
            inlet.wait_in(self._heavy)
        else:
            inlet.go_on()


class Inlet:
    """The bytes of one connection that are not parsed yet."""

    def __init__(
        self, intake: Intake, piece_bytes: int, parse: Callable[[bytes], None], hold: Callable[[bool], None]
    ) -> None:
        """`hold` is called with whether the connection is not to be read."""
        self.unread = bytearray()
        self._intake, self._piece_bytes, self._parse, self._hold = intake, piece_bytes, parse, hold
        self._waits = False
        """True while it is in a queue."""
        self._parses = False
        self._passed_over: int | None = None

    def take(self, data: bytes) -> None:
        """Take what has come."""
        if self._passed_over is not None:
            self._passed_over += len(data)
            if self._passed_over > LINGER_BYTES:
                self._hold(True)
            return
        self.unread += data
        if not self._waits and not self._parses:
            self._intake.enter(self)

    def put_back(self, data: bytes) -> None:
        """Let bytes be parsed before those that have come since."""
        self.unread[:0] = data

    def pass_over(self) -> None:
        """Parse nothing more, and read only a little: the connection ends."""
        self._passed_over = 0
        self.unread.clear()

    def end(self) -> None:
        """The connection has ended, or is another's: forget it."""
        self.pass_over()
        self._waits = False
        del self._parse, self._hold  # and with them a circle

    def wait_in(self, queue: "deque[Inlet]") -> None:
        """Wait for a later turn."""
        self._waits = True
        queue.append(self)
        self._hold(True)

    def parse_until(self, until: float, clock: Callable[[], float]) -> None:
        """Parse a piece, and more of them while there is time."""
        self._parses = True
        try:
            while self.unread:
                piece = bytes(self.unread[: self._piece_bytes])
                del self.unread[: self._piece_bytes]
                self._parse(piece)
                if clock() >= until:
                    break
        finally:
            self._parses = False

    def go_on(self) -> None:
        """Let it be read again where it was not."""
        if self._waits:
            self._waits = False
            self._hold(False)


class Frequency:
    """A count of events in each second."""

    def __init__(self, most: int, clock: Callable[[], float] = monotonic) -> None:
        self._most, self._clock = most, clock
        self._since = clock()
        self._times = 0

    def is_exceeded(self, times: int) -> bool:
        """Count what happened just now; tell whether that was too often in this second."""
        now = self._clock()
        if now - self._since >= SECOND:
            self._since, self._times = now, 0
        self._times += times
        return self._times > self._most
