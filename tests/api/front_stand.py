"""A server with the gateway's protocols in front of a small application, on a real socket of this machine."""

import asyncio
import gc
import socket
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest
import uvicorn
import uvloop
from starlette.types import Receive, Scope, Send

from api.front.connections import ConnectionLimits
from api.front.http_protocol import HttpProtocol, protocols
from api.front.websocket_protocol import EVENTS
from gateway.core.events import EventHub

HOST = b"host: 127.0.0.1\r\n"
SOON_S = 0.05
"""Seconds to wait before a thing that should not happen counts as not happened."""
PATIENCE_S = 60.0
"""Seconds after which, on a busy machine too, a thing that has not happened never will."""


class Application:
    """Notes what is begun and done: `/wait` lasts until `go`, `/flood` sends without end, others echo.

    `/early` is answered at `go`, and its body is not read.
    """

    def __init__(self) -> None:
        self.begun: list[str] = []
        self.done: list[tuple[str, bytes]] = []
        self.left: list[str] = []
        self.go = asyncio.Event()
        self.hub: EventHub | None = None
        """The events that a WebSocket follows."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "websocket":
            if scope["path"] == "/denied":
                await self._deny(receive, send)
            else:
                await self._follow(scope, receive, send)
            return
        path = scope["path"]
        self.begun.append(path)
        body = b""
        while path != "/early":
            message = await receive()
            if message["type"] == "http.disconnect":
                self.left.append(path)
                return
            body += message["body"]
            if not message["more_body"]:
                break
        if path in ("/wait", "/early"):
            await self.go.wait()
        if path == "/headers":
            body = repr(scope["headers"]).encode()
        self.done.append((path, body))
        answer = path.encode() + b" " + body
        length = (b"content-length", str(len(answer)).encode())
        await send({"type": "http.response.start", "status": 200, "headers": [length]})
        await send({"type": "http.response.body", "body": answer})

    async def _follow(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send events, which the client may leave unread, until it has left."""
        await receive()
        await send({"type": "websocket.accept", "subprotocol": next(iter(scope["subprotocols"]), None)})
        self.begun.append("websocket")
        sender = asyncio.create_task(self._flood(send)) if self.go.is_set() else None
        if self.hub is not None:
            outlet = scope["extensions"][EVENTS]["outlet"]
            sender = asyncio.create_task(self.hub.subscribe().deliver(outlet))
        while (await receive())["type"] != "websocket.disconnect":
            pass
        self.left.append("websocket")
        if sender is not None:
            sender.cancel()
            await asyncio.gather(sender, return_exceptions=True)

    async def _deny(self, receive: Receive, send: Send) -> None:
        """Answer a handshake as a request."""
        await receive()
        await send({"type": "websocket.http.response.start", "status": 403, "headers": [(b"x", b"y")]})
        await send({"type": "websocket.http.response.body", "body": b"no"})

    async def _flood(self, send: Send) -> None:
        while True:
            await send({"type": "websocket.send", "text": "x" * 10_000})


class Client:
    """A connection on which bytes are said as they stand."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader = reader
        self.writer = writer

    def say(self, *parts: bytes) -> None:
        self.writer.write(b"".join(parts))

    def ask(self, target: str, body: bytes = b"", *headers: bytes, method: str = "POST") -> None:
        """Ask for something in the usual way."""
        head = f"{method} {target} HTTP/1.1\r\ncontent-length: {len(body)}\r\n".encode()
        self.say(head, HOST, *(header + b"\r\n" for header in headers), b"\r\n", body)

    async def answer(self) -> tuple[int, bytes]:
        """The status and the body of the next answer.

        :raises EOFError: the connection ended without one.
        """
        async with asyncio.timeout(PATIENCE_S):
            head = await self.reader.readuntil(b"\r\n\r\n")
            length = next(
                int(line.partition(b":")[2])
                for line in head.lower().split(b"\r\n")
                if line.startswith(b"content-length")
            )
            return int(head.split(b" ", 2)[1]), await self.reader.readexactly(length)

    async def ended(self) -> bool:
        """Wait for the end of the connection."""
        async with asyncio.timeout(PATIENCE_S):
            try:
                while await self.reader.read(65_536):
                    pass
            except ConnectionError:
                pass
            return True

    def leave(self) -> None:
        self.writer.close()


@dataclass
class Front:
    """The server of a story, and its application."""

    app: Application
    http: type[HttpProtocol]
    server: uvicorn.Server
    port: int
    clients: list[Client] = field(default_factory=list)

    async def client(self) -> Client:
        client = Client(*await asyncio.open_connection("127.0.0.1", self.port))
        self.clients.append(client)
        return client

    async def until(self, look: Callable[[], bool]) -> None:
        async with asyncio.timeout(PATIENCE_S):
            while not look():  # noqa: ASYNC110  # another program's socket gives no event
                await asyncio.sleep(0.002)

    @property
    def connections(self) -> int:
        return len(self.server.server_state.connections)


@contextmanager
def garbage() -> Iterator[list[Any]]:
    """Give, at the end, what was left to the collector meanwhile."""
    found: list[Any] = []
    gc.collect()
    gc.disable()
    try:
        yield found
        gc.set_debug(gc.DEBUG_SAVEALL)
        gc.collect()
        found += gc.garbage
    finally:
        gc.set_debug(0)
        gc.garbage.clear()
        gc.enable()


Story = Callable[[Front], Coroutine[Any, Any, None]]


@asynccontextmanager
async def build_front(limits: ConnectionLimits, connections: int) -> AsyncIterator[Front]:
    http = protocols(connections, limits)
    app = Application()
    config = uvicorn.Config(
        app, http=http, ws="none", lifespan="off", log_config=None, access_log=False, ws_max_size=65_536
    )
    server = uvicorn.Server(config)
    server.config.load()
    server.lifespan = config.lifespan_class(config)
    with socket.create_server(("127.0.0.1", 0), backlog=256) as listener:
        await server.startup([listener])
        front = Front(app, http, server, listener.getsockname()[1])
        try:
            yield front
        finally:
            app.go.set()
            for client in front.clients:
                client.leave()
            for accepting in server.servers:
                accepting.close()
            await front.until(lambda: not front.connections and not server.server_state.tasks)


def on_front(connections: int = 100, **limits: float) -> Callable[[Story], Callable[..., None]]:
    """Turn a story about a server into a test; `limits` are small, so that the test waits for little."""

    def as_test(story: Story) -> Callable[..., None]:
        def test(caplog: pytest.LogCaptureFixture) -> None:
            async def run() -> None:
                chosen = ConnectionLimits(**limits)  # type: ignore[arg-type]  # numbers by their names
                async with build_front(chosen, connections) as front:
                    await story(front)

            uvloop.run(run())
            assert "Traceback" not in caplog.text
            assert "ASGI" not in caplog.text
            assert not [record for record in caplog.records if record.exc_info]

        return test

    return as_test
