"""WebSocket clients that follow events: `python -m benchmarks.subscribers PORT READING SILENT`."""

import asyncio
import sys
from os import nice
from typing import cast

import uvloop

from benchmarks.http_client import open_for

HANDSHAKE = (
    b"GET %b HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
)
PONG = b"\x8a\x84\x00\x00\x00\x00"
"""Pong with a mask that changes nothing; the four bytes of the ping follow."""
PING = b"\x89\x04"
VALUE = b'"pulses":'


class Subscriber(asyncio.Protocol):
    """A client that reads all, or nothing at all."""

    def __init__(self, target: str = "/events", handshake: bytes = HANDSHAKE, *, reads: bool = True) -> None:
        self.values = 0
        self._target = target.encode()
        self.open = asyncio.Event()
        self.received = 0
        self._handshake, self._reads = handshake, reads

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Ask for the events."""
        self._transport = cast("asyncio.Transport", transport)
        self._transport.write(self._handshake % self._target)

    def data_received(self, data: bytes) -> None:
        """Count what comes, and answer pings."""
        if not self.open.is_set():
            self.open.set()
            if not self._reads:
                self._transport.pause_reading()
        elif data.startswith(PING):
            self._transport.write(PONG + data[2:6])
        self.received += len(data)
        self.values += data.count(VALUE)

    def leave(self) -> None:
        """End the connection."""
        self._transport.abort()


async def subscribe(port: int, count: int, *, reads: bool = True) -> list[Subscriber]:
    """Open `count` connections, one after the other; give them when all are open."""
    clients = [Subscriber(reads=reads) for _ in range(count)]
    for client in clients:
        await open_for(client, port)
        await client.open.wait()
    return clients


async def main(port: int, reading: int, silent: int) -> None:
    """Follow until the process is ended."""
    clients = [*await subscribe(port, reading), *await subscribe(port, silent, reads=False)]
    print("subscribed", flush=True)
    await asyncio.gather(*(asyncio.Event().wait() for _ in clients))


if __name__ == "__main__":
    nice(10)  # on a small machine they share a processor with the clock that measures
    uvloop.run(main(*map(int, sys.argv[1:])))
