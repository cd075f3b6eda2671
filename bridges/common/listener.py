"""Serves `/metrics` and `/status` over HTTP, for monitoring; nothing else, and nothing of secrets."""

import asyncio
import json
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, Final

from prometheus_client import CONTENT_TYPE_LATEST, generate_latest

from bridges.common.state import Figures

log = logging.getLogger(__name__)

REQUEST_S: Final = 5.0
"""A request has to be here by then."""
MOST_BYTES: Final = 8192
MOST_AT_ONCE: Final = 16

Status = Callable[[], dict[str, Any]]


class CannotListen(OSError):
    """The address cannot be had."""


@asynccontextmanager
async def listening(address: str | None, figures: Figures, status: Status) -> AsyncIterator[None]:
    """Serve while the block runs, if an address is given; port 0 takes a free one, which the log names.

    :raises CannotListen: it cannot be had.
    """
    if address is None:
        yield
        return
    host, _, port = address.rpartition(":")
    answers = _Answers(figures, status)
    try:
        server = await asyncio.start_server(answers.serve, host.strip("[]"), int(port), limit=MOST_BYTES)
    except OSError as error:
        raise CannotListen(f"{address} cannot be listened at: {error.strerror or error}.") from None
    host, port = server.sockets[0].getsockname()[:2]
    log.info("metrics at http://%s:%s/metrics", host, port)
    async with server:
        yield


class _Answers:
    def __init__(self, figures: Figures, status: Status) -> None:
        self._figures, self._status = figures, status
        self._busy = asyncio.Semaphore(MOST_AT_ONCE)

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer the one request of a connection."""
        try:
            async with asyncio.timeout(REQUEST_S), self._busy:
                head = await reader.readuntil(b"\r\n\r\n")
                writer.write(self._answer(head.split(b"\r\n", 1)[0].decode("latin-1")))
                await writer.drain()
        except (TimeoutError, OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            return  # nobody waits for an answer
        finally:
            writer.close()

    def _answer(self, request: str) -> bytes:
        method, _, rest = request.partition(" ")
        path = rest.partition(" ")[0].partition("?")[0]
        if method not in ("GET", "HEAD"):
            return _response("405 Method Not Allowed", "text/plain", b"Only GET is served.\n")
        if path == "/metrics":
            return _response("200 OK", CONTENT_TYPE_LATEST, generate_latest(self._figures.registry))
        if path == "/status":
            status = self._status()
            line = "200 OK" if status["state"] == "online" else "503 Service Unavailable"
            return _response(line, "application/json", json.dumps(status, ensure_ascii=False).encode())
        return _response("404 Not Found", "text/plain", b"There are /metrics and /status.\n")


def _response(status: str, content_type: str, body: bytes) -> bytes:
    head = (
        f"HTTP/1.1 {status}\r\nContent-Type: {content_type}\r\nContent-Length: {len(body)}\r\n"
        "Cache-Control: no-store\r\nConnection: close\r\n\r\n"
    )
    return head.encode("latin-1") + body
