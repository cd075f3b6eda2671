"""The bounds of a client: connections, time, and its part of each turn of the event loop."""

from dataclasses import dataclass


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


LINGER_S = 0.5
"""A refused connection stays open for this time, so that its client can read why."""
LINGER_BYTES = 262_144
"""Bytes that its client still sends and that are taken, and passed over."""
