"""The gateway and a bare broadcast in one process: `python -m benchmarks.broadcast PORT CONFIG PORT COUNT S`.

When the bare one has COUNT clients it publishes events at a steady rate for S seconds, to the clients of the
gateway and to its own in turn, and prints the microseconds of processor time that a message took.
"""

import asyncio
import sys
from pathlib import Path
from time import process_time
from typing import cast
from unittest.mock import patch

import uvloop

from app.server import serve
from benchmarks.full_ring import a_move
from gateway.config import load
from gateway.core.events import EventHub

RATE = 100
"""Events a second: each finds all clients waiting."""
SETTLE_S = 0.05
"""Seconds in which the last message leaves."""


class Broadcast(asyncio.Protocol):
    """Connections that are sent what is published, and nothing else."""

    def __init__(self) -> None:
        self.transports: list[asyncio.Transport] = []
        self._hub = EventHub()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Send to one more."""
        self.transports.append(cast("asyncio.Transport", transport))

    def data_received(self, _data: bytes) -> None:
        """Say that the newest connection is a WebSocket."""
        self.transports[-1].write(b"HTTP/1.1 101 Switching Protocols\r\n\r\n")

    def publish(self, type_: str, subject: str, data: dict[str, object]) -> None:
        """Write an event as the gateway does, and send it."""
        text = self._hub.publish(type_, subject, data).json.encode()
        frame = b"\x81\x7e" + len(text).to_bytes(2, "big") + text
        for transport in self.transports:
            if not transport.is_closing():
                transport.write(frame)


async def main(config: Path, bare_port: int, count: int, seconds: float) -> None:
    """Measure, and go on until the process is ended."""
    loop, hub, bare = asyncio.get_running_loop(), EventHub(), Broadcast()
    await loop.create_server(lambda: bare, "127.0.0.1", bare_port)
    with patch("gateway.plant.EventHub", lambda: hub):
        serving = asyncio.create_task(serve(load(config), config.with_suffix(".data")))
        while len(bare.transports) < count:  # noqa: ASYNC110  # a protocol has no event for it
            await asyncio.sleep(0.05)
        while not serving.done():
            ours = await _us_a_message(hub, count, seconds)
            print(ours, await _us_a_message(bare, count, seconds), flush=True)


async def _us_a_message(channel: EventHub | Broadcast, count: int, seconds: float) -> float:
    began, events = process_time(), max(1, round(RATE * seconds))
    for number in range(events):
        channel.publish("body.move.succeeded", "/bodies/line.3F", a_move(number))
        await asyncio.sleep(1 / RATE)
    await asyncio.sleep(SETTLE_S)
    return 1e6 * (process_time() - began) / events / count


if __name__ == "__main__":
    uvloop.run(main(Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]), float(sys.argv[5])))
