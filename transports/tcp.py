"""TCP ports: terminal servers and the simulator."""

import asyncio
import fcntl
import socket
import struct
from typing import cast

from transports.addresses import Address
from transports.base import TransportUnavailable
from transports.stream import Session, StreamTransport

CONNECT_TIMEOUT_S = 5.0
# A far end that loses power says nothing: probed when silent, it is given up after about 11 s. A system
# without an option goes without it.
LIVENESS = {
    "TCP_KEEPIDLE": 5,  # s of silence before the first probe
    "TCP_KEEPINTVL": 2,  # s between probes
    "TCP_KEEPCNT": 3,  # probes without an answer
    "TCP_USER_TIMEOUT": 11_000,  # ms that sent bytes may stay unacknowledged
}
# Linux: bytes in the socket's buffer that were never sent; those sent but not acknowledged do not count.
SIOCOUTQNSD = 0x894B


class TcpPort(StreamTransport):
    """`tcp://host:port`: a raw byte stream, without RFC 2217."""

    is_bridged = True

    def __init__(self, address: Address) -> None:
        super().__init__(address.text)
        if not address.host or not address.port or address.path:
            raise ValueError(f"address {address.text!r} must be written tcp://host:port, port 1 to 65535")
        address.expect_options()
        self._host = address.host
        self._port = address.port

    async def _connect(self) -> tuple[asyncio.Transport, Session]:
        loop = asyncio.get_running_loop()
        try:
            async with asyncio.timeout(CONNECT_TIMEOUT_S):
                channel, session = await loop.create_connection(
                    lambda: _TcpSession(self.address), self._host, self._port
                )
        except (OSError, UnicodeError) as error:
            reason = _reason(error)
            raise TransportUnavailable(
                f"{self.address} was not opened: {reason}. Nothing was sent."
            ) from error
        channel.resume_reading()
        return channel, session

    def _held_by_system(self, channel: asyncio.Transport) -> int:
        try:
            answer = fcntl.ioctl(_socket_of(channel).fileno(), SIOCOUTQNSD, bytes(4))
        except OSError:
            return 0  # this system does not tell
        return int(struct.unpack("i", answer)[0])


class _TcpSession(Session):
    """A session whose far end can hang up."""

    _channel: asyncio.Transport

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Set the socket up, and hold its first bytes back until the opener has heard that it is open."""
        self._channel = cast("asyncio.Transport", transport)
        self._channel.pause_reading()
        _set_options(_socket_of(self._channel))

    def eof_received(self) -> bool:
        """Drop unsent bytes: the far end no longer takes them, and waiting for it would hide the loss."""
        self._channel.abort()
        return True


def _socket_of(channel: asyncio.Transport) -> socket.socket:
    return cast("socket.socket", channel.get_extra_info("socket"))


def _set_options(sock: socket.socket) -> None:
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in LIVENESS.items():
        if hasattr(socket, name):
            sock.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)


def _reason(error: Exception) -> str:
    match error:
        case TimeoutError():
            return f"no answer within {CONNECT_TIMEOUT_S:g} s; check the address, the cable and the power"
        case ConnectionRefusedError():
            return "the far end refused; check the port number and that it serves no other client"
        case socket.gaierror():
            return "the host name is not known"
        case _:
            return str(error)
