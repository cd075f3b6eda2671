"""A byte stream that the event loop reads and writes: the common part of serial and TCP ports."""

import asyncio
from abc import abstractmethod

from transports.base import Receiver, Transport, TransportLost, TransportUnavailable


class Session(asyncio.Protocol):
    """One opening of a port, from open to lost or closed: passes what arrives straight to the receiver."""

    def __init__(self, address: str) -> None:
        self._address = address
        self._receiver: Receiver | None = None
        self._reason: Exception | str = "the far end closed it"
        self._gone = asyncio.Event()

    def begin(self, receiver: Receiver) -> None:
        """From now on tell the receiver what happens."""
        self._receiver = receiver

    def data_received(self, data: bytes) -> None:
        """Pass on what has arrived."""
        if self._receiver is not None:
            self._receiver.data_received(data)

    def fail(self, channel: asyncio.Transport, error: Exception) -> None:
        """Give up a channel that has met an error without noticing."""
        self._reason = error
        if not channel.is_closing():
            channel.abort()

    def connection_lost(self, error: Exception | None) -> None:
        """Tell the receiver why the port has gone, unless we closed it."""
        self._gone.set()
        if self._receiver is not None:
            self._receiver.connection_lost(
                TransportLost(
                    f"{self._address} was lost ({error or self._reason}). What was sent last may not have "
                    "arrived; check the cable and the far end."
                )
            )

    async def end(self, channel: asyncio.Transport) -> None:
        """Drop the channel, tell the receiver nothing more, and wait until the channel is gone."""
        self._receiver = None
        if not channel.is_closing():
            channel.abort()
        await self._gone.wait()


class StreamTransport(Transport):
    """A port that is served by an asyncio transport, here called its channel."""

    def __init__(self, address: str) -> None:
        super().__init__(address)
        self._session: Session | None = None
        self._channel: asyncio.Transport | None = None

    @abstractmethod
    async def _connect(self) -> tuple[asyncio.Transport, Session]:
        """Open the port; its session reports to no receiver yet.

        :raises TransportUnavailable: it cannot be opened.
        """

    async def open(self, receiver: Receiver) -> None:
        """Open the port; a port that is open already is refused."""
        if self._live_channel() is not None:
            raise TransportUnavailable(f"{self.address} is open already; nothing was sent.")
        self._channel, self._session = await self._connect()
        self._session.begin(receiver)

    def write(self, data: bytes) -> None:
        """Hand bytes to the channel."""
        channel = self._live_channel()
        if channel is None:
            raise TransportLost(f"{self.address} is not open; nothing was sent.")
        channel.write(data)

    def unsent(self) -> int:
        """Bytes in the channel's own buffer and in the operating system's; 0 when the port is not open."""
        channel = self._live_channel()
        if channel is None:
            return 0
        return channel.get_write_buffer_size() + self._held_by_system(channel)

    @abstractmethod
    def _held_by_system(self, channel: asyncio.Transport) -> int:
        """Bytes the operating system has taken but not sent; 0 where it does not tell."""

    async def close(self) -> None:
        """Close at once."""
        channel, session = self._channel, self._session
        self._channel = self._session = None
        if channel is not None and session is not None:
            await session.end(channel)

    def _live_channel(self) -> asyncio.Transport | None:
        if self._channel is None or self._channel.is_closing():
            return None
        return self._channel
