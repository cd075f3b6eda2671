"""Requests of a connection that are not answered yet: ASGI to the application, HTTP/1.1 to the client."""

import asyncio
import logging
from collections.abc import Callable, Iterable
from http import HTTPStatus
from typing import Final, Protocol

from starlette.types import ASGIApp, Message, Scope

from api.front.refusals import head_of

log = logging.getLogger(__name__)

_BARE: Final = frozenset({HTTPStatus.NO_CONTENT, HTTPStatus.NOT_MODIFIED})
"""Answers that have no body, and say no length."""


class RequestConnection(Protocol):
    """What a request needs of its connection."""

    transport: asyncio.Transport
    room: asyncio.Event | None
    """Set when there is room for more of an answer; None: there is."""

    @property
    def default_headers(self) -> list[tuple[bytes, bytes]]:
        """Headers of every answer."""

    def read_on(self) -> None:
        """Read, unless there is enough."""

    def on_answered(self) -> None:
        """The first request is answered as a whole."""


class PendingRequest:
    """A request as the application sees it: begun at its turn, a stop at once; answered at its turn."""

    def __init__(
        self,
        connection: RequestConnection,
        app: ASGIApp,
        scope: Scope,
        *,
        keep_alive: bool,
        continues: bool,
        is_stop: bool,
        is_urgent: bool,
    ) -> None:
        self.is_stop = is_stop
        self.is_urgent = is_urgent
        """Whether it begins as soon as it has its turn on its connection, however many others ask."""
        self.keep_alive = keep_alive
        """Whether the connection goes on after the answer."""
        self.has_turn = False
        """Whether it may be answered: all before it are."""
        self.on_end: Callable[[], None] | None = None
        """Called when it has ended, in whatever way."""
        self.started = False
        self.body = bytearray()
        """What has come, and was not taken yet."""
        self.more_body = True
        self.gone = False
        """Whether nobody waits for the answer any more."""
        self.answering = self.answered = False
        self.leaves_unread = False
        """Whether it was answered for good before its body had come, so that more of it may be under way."""
        self._connection, self._app, self._scope = connection, app, scope
        self._continues = continues
        """Whether the client waits for a word before it sends the body."""
        self._turn: asyncio.Event | None = None
        self._arrived: asyncio.Event | None = None
        self._news = False
        """Whether something has come since the application last took it."""
        self._begun = self._taken = self._waits_for_body = False
        self._head = b""
        """Written together with the beginning of the body."""
        self._chunked = False
        self._left = 0
        """Bytes of the answer that are still to come, if it said how many."""

    @property
    def undone(self) -> bool:
        """Whether it is certain that nothing was done yet: it waits for its turn, or for its body."""
        return not self._begun or self._waits_for_body

    def give_up(self) -> None:
        """Its client has left, or it can never be read as a whole."""
        self.gone = self.gone or not self.answered
        self._wake()
        self.give_turn()

    def give_turn(self) -> None:
        """Let it be answered."""
        self.has_turn = True
        if self._turn is not None:
            self._turn.set()

    def take(self, body: bytes, *, more: bool) -> None:
        """Take a part of the body; more of an answered request is passed over."""
        if not self.answered:
            self.body += body
            self.more_body = more
            self._news = True
            self._wake()

    def _wake(self) -> None:
        if self._arrived is not None:
            self._arrived.set()

    async def run(self) -> None:
        """Do what is asked for; nothing, where the client has left before, unless it is a stop."""
        try:
            if self.is_stop or not self.gone:
                self._begun = True
                await self._app(self._scope, self._receive, self._send)
        except asyncio.CancelledError:
            self._connection.transport.close()
            raise
        except Exception:
            log.exception("A request has failed.")
        finally:
            if self.on_end is not None:
                self.on_end()
        if not self.answered and not self.gone:
            await self._answer_instead()

    async def _answer_instead(self) -> None:
        """Answer for an application that did not, or end the connection in the middle of its answer."""
        if self.answering:
            self._connection.transport.close()
            return
        text = b"Internal Server Error"
        headers = [(b"content-type", b"text/plain"), (b"content-length", b"%d" % len(text))]
        self.keep_alive = False
        await self._send({"type": "http.response.start", "status": 500, "headers": headers})
        await self._send({"type": "http.response.body", "body": text})

    async def _receive(self) -> Message:
        if self._continues and not self._connection.transport.is_closing():
            self._connection.transport.write(b"HTTP/1.1 100 Continue\r\n\r\n")
            self._continues = False
        if not (self._news or self.gone or self.answered):
            await self._wait_for_more()
        self._news = False
        # That its client has left since changes nothing for a stop that came as a whole.
        is_there = self.is_stop and not self._taken and not self.more_body
        if (self.gone or self.answered) and not is_there:
            self._taken = True
            return {"type": "http.disconnect"}
        body, self.body = bytes(self.body), bytearray()
        self._taken = not self.more_body
        return {"type": "http.request", "body": body, "more_body": self.more_body}

    async def _wait_for_more(self) -> None:
        self._connection.read_on()
        self._waits_for_body = not self._taken
        self._arrived = self._arrived or asyncio.Event()
        self._arrived.clear()
        try:
            await self._arrived.wait()
        finally:
            self._waits_for_body = False

    async def _send(self, message: Message) -> None:
        if not self.has_turn:
            self._turn = self._turn or asyncio.Event()
            await self._turn.wait()
        if self._connection.room is not None and not self.gone:
            await self._connection.room.wait()
        if self.gone:
            return
        if not self.answering:
            self._begin_answer(message["status"], message.get("headers", ()))
        elif not self.answered:
            self._go_on(message.get("body", b""), more=message.get("more_body", False))
        else:
            raise RuntimeError("More was sent than an answer.")

    def _begin_answer(self, status: int, headers: Iterable[tuple[bytes, bytes]]) -> None:
        said = [*self._connection.default_headers, *headers]
        length = next((value for name, value in said if name == b"content-length"), None)
        if (b"connection", b"close") in said:
            self.keep_alive = False
        elif not self.keep_alive:
            said.append((b"connection", b"close"))
        if length is not None:
            self._left = int(length)
        elif self._scope["method"] != "HEAD" and status not in _BARE:
            self._chunked = True
            said.append((b"transfer-encoding", b"chunked"))
        self._head = head_of(status, said)
        self.answering, self._continues = True, False
        if self._chunked:  # it may be long until the first part comes
            self._write(b"")

    def _go_on(self, body: bytes, *, more: bool) -> None:
        if self._scope["method"] == "HEAD":
            body, self._left = b"", 0
        elif self._chunked:
            body = (b"%x\r\n%b\r\n" % (len(body), body) if body else b"") + (b"" if more else b"0\r\n\r\n")
        else:
            self._left -= len(body)
            if self._left < 0 or (self._left and not more):
                raise RuntimeError("An answer is not as long as it says.")
        self._write(body)
        if not more:
            self._end()

    def _write(self, data: bytes) -> None:
        self._connection.transport.write(self._head + data)
        self._head = b""

    def _end(self) -> None:
        self.answered = True
        self._wake()
        self.leaves_unread = self.more_body and not self.keep_alive
        if not self.keep_alive and not self.leaves_unread:
            self._connection.transport.close()
        self._connection.on_answered()
