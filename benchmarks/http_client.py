"""A lean HTTP/1.1 client with connections kept alive: the same for the gateway and for its yardstick."""

import asyncio
import json
import re
import socket
import ssl
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import cycle
from time import perf_counter
from typing import cast

_LENGTH = re.compile(rb"\r\ncontent-length: *(\d+)\r\n", re.IGNORECASE)
_HEAD_END = b"\r\n\r\n"


def get(path: str) -> bytes:
    """Build a request without a body."""
    return f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode()


def post(path: str, content: object) -> bytes:
    """Build a request with a JSON body."""
    body = json.dumps(content)
    return (
        f"POST {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
        f"Content-Length: {len(body)}\r\n\r\n{body}"
    ).encode()


def is_complete(response: bytes) -> bool:
    """Say whether a response has arrived as a whole.

    :raises RuntimeError: it says that the request failed.
    """
    head, found, content = response.partition(_HEAD_END)
    length = _LENGTH.search(head + b"\r\n")
    if not found or (length and len(content) < int(length[1])):
        return False
    if not head.startswith(b"HTTP/1.1 2") or not length:
        raise RuntimeError(f"not measured, because a request failed: {response.decode('latin-1')}")
    return True


def connect(port: int) -> socket.socket:
    """Connect to a server on this machine."""
    sock = socket.create_connection(("127.0.0.1", port))
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return sock


@dataclass(frozen=True)
class Door:
    """Where a gateway is asked, and what it wants to see."""

    port: int
    token: str = ""
    trusting: ssl.SSLContext | None = None
    """Makes it TLS."""

    def connect(self) -> socket.socket:
        """Connect to it."""
        sock = connect(self.port)
        return self.trusting.wrap_socket(sock, server_hostname="127.0.0.1") if self.trusting else sock

    def signed(self, request: bytes) -> bytes:
        """Let a request show the key."""
        key = f"\r\nAuthorization: Bearer {self.token}\r\n\r\n".encode()
        return request.replace(_HEAD_END, key, 1) if self.token else request


def ask(sock: socket.socket, request: bytes) -> bytes:
    """Send one request and wait for its response."""
    sock.sendall(request)
    response = sock.recv(65_536)
    while not is_complete(response):
        response += sock.recv(65_536)
    return response


def latencies(port: int, requests: list[bytes], seconds: float) -> list[float]:
    """Ask one after the other on one connection; the seconds each took."""
    taken: list[float] = []
    with connect(port) as sock:
        ends_at = perf_counter() + seconds
        for request in cycle(requests):
            begun_at = perf_counter()
            ask(sock, request)
            ended_at = perf_counter()
            taken.append(ended_at - begun_at)
            if ended_at >= ends_at:
                break
    return taken


class Client(asyncio.Protocol):
    """One of many connections, each asking again as soon as it is answered."""

    def __init__(self, requests: Iterator[bytes]) -> None:
        self.answered = 0
        self.failure: RuntimeError | None = None
        self._requests = requests
        self._response = b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Ask for the first time."""
        self._transport = cast("asyncio.Transport", transport)
        self._transport.write(next(self._requests))

    def data_received(self, data: bytes) -> None:
        """Ask again when the response is complete."""
        self._response += data
        try:
            complete = is_complete(self._response)
        except RuntimeError as failure:
            self.failure = failure
            return
        if complete:
            self.answered += 1
            self._response = b""
            self._transport.write(next(self._requests))

    def close(self) -> None:
        """End the connection.

        :raises RuntimeError: a request failed.
        """
        self._transport.abort()
        if self.failure:
            raise self.failure


async def open_for(client: asyncio.BaseProtocol, port: int, trusting: ssl.SSLContext | None = None) -> None:
    """Give a client its connection to a server on this machine."""
    loop = asyncio.get_running_loop()
    await loop.create_connection(lambda: client, "127.0.0.1", port, ssl=trusting)


def _answered(clients: list[Client]) -> int:
    return sum(client.answered for client in clients)


async def requests_per_s(port: int, clients: int, requests: list[bytes], seconds: float) -> float:
    """Answers a second on many connections at once, with the requests spread over them."""
    loop = asyncio.get_running_loop()
    asking = [Client(_from(requests, first)) for first in range(clients)]
    for client in asking:
        await open_for(client, port)
    before, begun_at, answered = _answered(asking), loop.time(), 0
    while not answered and not any(client.failure for client in asking):
        await asyncio.sleep(seconds)
        answered = _answered(asking) - before
    rate = answered / (loop.time() - begun_at)
    for client in asking:
        client.close()
    return rate


def _from(requests: list[bytes], first: int) -> Iterator[bytes]:
    first %= len(requests)
    return cycle([*requests[first:], *requests[:first]])
