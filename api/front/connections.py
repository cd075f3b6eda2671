"""The bounds of each connection, and the limit of their number; a connection beyond it may still stop."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from time import monotonic
from typing import Protocol

log = logging.getLogger(__name__)

LINGER_S = 0.5
"""A refused connection stays open for this time, so that its client can read why."""
LINGER_BYTES = 262_144
"""Bytes that its client still sends and that are taken, and passed over."""
RESERVE = 64
"""Connections beyond the limit, at which only stops are served."""
IDLE_S = 1.0
"""A connection that has been idle for this time makes room for a new one."""


@dataclass(frozen=True)
class ConnectionLimits:
    """The bounds of a server's connections, HTTP and WebSocket alike."""

    head_bytes: int = 16_384
    """A longer head, trailer or chunk extension ends its connection."""
    head_lines: int = 100
    """A head with more header lines ends its connection; they are kept as long as the request."""
    receive_s: float = 10.0
    """A request has come as a whole by then."""
    stall_s: float = 10.0
    """A client that takes nothing of an answer for this time loses the connection."""
    requests_ahead: int = 64
    """Requests that may be sent ahead of the answers to those before them."""
    frames_per_s: int = 100
    """WebSocket frames that a client may send in a second; it has nothing to say but to answer pings."""
    piece_bytes: int = 256
    """Bytes are parsed in pieces: a WebSocket's, full of empty frames, takes half a millisecond."""
    connection_s: float = 0.0002
    """Time for which one connection's bytes are parsed in a turn of the loop; a piece is, however long."""
    turn_s: float = 0.001
    """Seconds of the same for all connections together. A stop takes half a dozen turns to its answer."""


class OpenConnection(Protocol):
    """A connection that can be made to end."""

    def give_way(self) -> None:
        """End at once."""


class Admitted(Enum):
    """The requests that a connection may make."""

    EVERYTHING = auto()
    STOPS = auto()
    NOTHING = auto()


class ConnectionLimit:
    """Decides what a new connection may ask for.

    At the limit the connection that has been idle longest makes room. Where none is idle a new one may ask
    for stops only. There are `reserve` of these; then the oldest that has not asked for one yet makes room.
    """

    def __init__(self, limit: int, reserve: int = RESERVE, clock: Callable[[], float] = monotonic) -> None:
        self._limit = limit
        self._reserve = reserve
        self._clock = clock
        self._idle_since: dict[OpenConnection, float] = {}
        self._waiting: dict[OpenConnection, None] = {}
        self._stopping: set[OpenConnection] = set()
        self._full = False

    def admit(self, connection: OpenConnection, connected: int) -> Admitted:
        """Decide about a new connection; `connected` are all there are, with the new one."""
        admitted = connected - len(self._waiting) - len(self._stopping)
        if admitted <= self._limit or self._an_idle_one_gives_way():
            self._tell(full=admitted > self._limit)
            self.rest(connection)
            return Admitted.EVERYTHING
        self._tell(full=True)
        if len(self._waiting) + len(self._stopping) >= self._reserve and not self._a_waiting_one_gives_way():
            return Admitted.NOTHING
        self._waiting[connection] = None
        return Admitted.STOPS

    def rest(self, connection: OpenConnection) -> None:
        """Note that nothing is asked on a connection now."""
        self._idle_since[connection] = self._clock()

    def ask(self, connection: OpenConnection) -> None:
        """Note that something is asked on a connection."""
        self._idle_since.pop(connection, None)

    def stop(self, connection: OpenConnection) -> None:
        """Note that a connection beyond the limit has asked for a stop: it does not give way any more."""
        if connection in self._waiting:
            del self._waiting[connection]
            self._stopping.add(connection)

    def leave(self, connection: OpenConnection) -> None:
        """Forget a connection."""
        self._idle_since.pop(connection, None)
        self._waiting.pop(connection, None)
        self._stopping.discard(connection)

    def _an_idle_one_gives_way(self) -> bool:
        longest = next(iter(self._idle_since), None)
        if longest is None or self._clock() - self._idle_since[longest] < IDLE_S:
            return False
        self._end(longest)
        return True

    def _a_waiting_one_gives_way(self) -> bool:
        longest = next(iter(self._waiting), None)
        if longest is not None:
            self._end(longest)
        return longest is not None

    def _end(self, connection: OpenConnection) -> None:
        self.leave(connection)
        connection.give_way()

    def _tell(self, *, full: bool) -> None:
        if full and not self._full:
            log.warning(
                "All %d connections are in use; idle ones are closed, and new ones may only stop.",
                self._limit,
            )
        self._full = full
