"""Clients over TLS: `python -m benchmarks.tls_clients PORT AUTHORITY TOKEN READERS SUBSCRIBERS`."""

import asyncio
import ssl
import sys
from functools import partial
from itertools import repeat
from os import nice

import uvloop

from benchmarks.http_client import Client, Door, get, open_for
from benchmarks.subscribers import HANDSHAKE, Subscriber

READ = get("/bodies/07")


class Reader(Client):
    """Reads flat out, once all are connected."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Wait."""
        self._begin = partial(super().connection_made, transport)

    def begin(self) -> None:
        """Ask for the first time."""
        self._begin()


async def main(port: int, authority: str, token: str, readers: int, subscribers: int) -> None:
    """Read flat out on many connections, and follow events on others, until the process is ended."""
    door = Door(port, token, ssl.create_default_context(cafile=authority))
    following = [Subscriber(handshake=door.signed(HANDSHAKE)) for _ in range(subscribers)]
    reading = [Reader(repeat(door.signed(READ))) for _ in range(readers)]
    for one in (*following, *reading):
        await open_for(one, port, door.trusting)
    await asyncio.gather(*(client.open.wait() for client in following))
    for client in reading:
        client.begin()
    print("connected", flush=True)
    await asyncio.Event().wait()


if __name__ == "__main__":
    nice(10)  # on a small machine they share a processor with the clock that measures
    _, web_port, its_authority, its_token, *counts = sys.argv
    uvloop.run(main(int(web_port), its_authority, its_token, *map(int, counts)))
