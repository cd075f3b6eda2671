"""Clients that ask for too much, one a kind: `python -m benchmarks.hostile PORT documents slow-heads`."""

import asyncio
import sys
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from itertools import cycle
from os import nice

import uvloop

from benchmarks.http_client import get, is_complete

GIANT_BYTES = 120 * 2**20
PIECE = b"x" * 65_536
SLOW_HEADS = 50
PAUSE_S = 0.2
DOCUMENTS = (
    *("/", "/docs", "/docs/all", "/static-offline-docs/swagger-ui-bundle.js", "/redoc"),
    *("/openapi.json", "/openapi/core.json", "/openapi/resources.json"),
)
POSITIONS = tuple(f"/bodies/{body:02X}/position" for body in range(6, 8))


async def fetch(port: int, *paths: str) -> None:
    """Ask for one path after the other, flat out; every second time for packed bytes."""
    plain = [get(path) for path in paths]
    packed = [request.replace(b"\r\n\r\n", b"\r\nAccept-Encoding: gzip\r\n\r\n") for request in plain]
    reader, writer = await asyncio.open_connection("127.0.0.1", port, limit=2**22)
    for request in cycle(plain + packed):
        writer.write(request)
        response = await reader.read(2**20)
        while not is_complete(response):
            response += await reader.read(2**20)


async def send_giant_heads(port: int) -> None:
    """Send a head that grows until the connection ends, again and again."""
    while True:
        with suppress(OSError):
            _, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\nX: ")
            for _ in range(GIANT_BYTES // len(PIECE)):
                writer.write(PIECE)
                await writer.drain()


async def send_slow_heads(port: int) -> None:
    """Keep many heads open that grow by a byte now and then."""
    await asyncio.gather(*(_send_slow_head(port) for _ in range(SLOW_HEADS)))


async def _send_slow_head(port: int) -> None:
    while True:
        with suppress(OSError):
            _, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\nX: ")
            while not writer.is_closing():
                writer.write(b"x")
                await writer.drain()
                await asyncio.sleep(PAUSE_S)


KINDS: Mapping[str, Callable[[int], Awaitable[None]]] = {
    "documents": lambda port: fetch(port, *DOCUMENTS),
    "commands": lambda port: fetch(port, "/commands"),
    "metrics": lambda port: fetch(port, "/metrics"),
    "giant-heads": send_giant_heads,
    "slow-heads": send_slow_heads,
    "reads": lambda port: fetch(port, *POSITIONS),
}


async def main(port: int, kinds: list[str]) -> None:
    """Run until the process is ended."""
    clients = asyncio.gather(*(KINDS[kind](port) for kind in kinds))
    await asyncio.sleep(PAUSE_S)
    print("asking", flush=True)
    await clients


if __name__ == "__main__":
    nice(10)  # on a small machine they share a processor with the clock that measures
    uvloop.run(main(int(sys.argv[1]), sys.argv[2:]))
