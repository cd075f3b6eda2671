"""The interface of a transport: it moves bytes and knows no commands."""

from abc import ABC, abstractmethod
from typing import Protocol

STUCK_S = 1.0
"""A port that takes no bytes for longer than this is of no use, unless its address says otherwise."""


class TransportError(OSError):
    """A port could not be used; the message says which and why."""


class TransportUnavailable(TransportError):
    """The port could not be opened: missing, refused, or taken by another program. Nothing was written."""


class TransportLost(TransportError):
    """The port has gone: unplugged, or closed by the far end. Bytes written last may not have arrived."""


class TransportRefused(TransportError):
    """The port does not carry this data; nothing of it was written, and the port stays open."""


class Receiver(Protocol):
    """The listener of an open transport. All calls come on the event loop's thread."""

    def data_received(self, data: bytes) -> None:
        """One or more bytes have arrived."""

    def connection_lost(self, error: TransportLost) -> None:
        """Called when the port has gone without `close`; once per opening at most, never after `close`."""


class Transport(ABC):
    """One port. It can be opened again after it was lost or closed."""

    byte_time_s = 0.0
    """Seconds one byte takes on the wire at this port's speed; 0.0 where the wire does not pace us."""
    is_bridged = False
    """True if a box at the far end passes the bytes on, at a speed that this port does not know."""
    stuck_s = STUCK_S
    """Seconds this port may take no bytes before it is to be opened anew."""

    def __init__(self, address: str) -> None:
        self.address = address

    @abstractmethod
    async def open(self, receiver: Receiver) -> None:
        """Open the port exclusively, without ever blocking the event loop.

        The receiver is called only after this has returned, and never when it has failed.

        :raises TransportUnavailable: nothing was opened.
        """

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Hand bytes to the operating system, all of them, in order.

        :raises TransportLost: the port is not open.
        :raises TransportRefused: a port of messages cannot carry one of this size.
        """

    @abstractmethod
    def unsent(self) -> int:
        """Bytes that were written but have not left this machine, as far as the operating system tells."""

    @abstractmethod
    async def close(self) -> None:
        """Close at once. Unsent bytes are dropped and not sent by a later opening; closing twice is harmless.

        Bytes that the far end is taking at this moment may still arrive, so they do not count as unsent.
        """
