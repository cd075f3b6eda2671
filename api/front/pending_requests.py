"""Requests of a connection that are not answered yet: ASGI to the application, HTTP/1.1 to the client."""

import asyncio
import logging
from collections.abc import Callable, Iterable
from http import HTTPStatus
from typing import Final, Protocol

from starlette.types import ASGIApp, Message, Scope

from api.front.flow import Flow
from api.front.refusals import head_of

log = logging.getLogger(__name__)

_BARE: Final = frozenset({HTTPStatus.NO_CONTENT, HTTPStatus.NOT_MODIFIED})
"""Answers that have no body, and say no length."""
_CONTINUE: Final = b"HTTP/1.1 100 Continue\r\n\r\n"


class RequestConnection(Protocol):
    """A connection, as its requests see it."""

    transport: asyncio.Transport
    flow: Flow

    @property
    def default_headers(self) -> list[tuple[bytes, bytes]]:
        """Headers of every answer."""

    def read_on(self) -> None:
        """Read, unless there is enough."""

    def on_answered(self) -> None:
        """The first request is answered as a whole."""


class RequestBody:
    """The body of a request: what has come of it, and was not taken by the application yet."""

    __slots__ = ("_arrived", "awaited", "content", "more", "news", "taken")

    def __init__(self) -> None:
        self.content = bytearray()
        self.more = True
        self.news = self.taken = self.awaited = False
        """True if something has come that the application has not seen; if it was told all; if it waits for
        more, and so has done nothing yet."""
        self._arrived: asyncio.Event | None = None

    def add(self, part: bytes, *, more: bool) -> None:
        """Take a part of it."""
        self.content += part
        self.more = more
        self.news = True
        self.wake()

    def wake(self) -> None:
        """Let the application see that something has changed."""
        if self._arrived is not None:
            self._arrived.set()

    async def change(self) -> None:
        """Wait for more of it, or for the end of the request."""
        self.awaited = not self.taken
        self._arrived = self._arrived or asyncio.Event()
        self._arrived.clear()
        try:
            await self._arrived.wait()
        finally:
            self.awaited = False

    def message(self) -> Message:
        """Give the application what has come."""
        content, self.content = bytes(self.content), bytearray()
        self.taken = not self.more
        return {"type": "http.request", "body": content, "more_body": self.more}


class AnswerWriter:
    """The bytes of an answer: its head with the beginning of its body, then the rest."""

    __slots__ = ("_bare", "_chunked", "_head", "_left", "begun", "over")

    def __init__(self, *, bare: bool) -> None:
        """A `bare` one has no body, whatever it says, as that of HEAD."""
        self.begun = self.over = False
        self._bare, self._chunked = bare, False
        self._head = b""
        """Written together with the beginning of the body."""
        self._left = 0
        """Bytes that are still to come, if it said how many."""

    def begin(self, status: int, said: list[tuple[bytes, bytes]]) -> bytes:
        """Give what is to be written at once: it may be long until the first part of a chunked body comes."""
        length = dict(said).get(b"content-length")
        if length is not None:
            self._left = int(length)
        elif not self._bare and status not in _BARE:
            self._chunked = True
            said.append((b"transfer-encoding", b"chunked"))
        self.begun = True
        self._head = head_of(status, said)
        return self._taken(b"") if self._chunked else b""

    def go_on(self, body: bytes, *, more: bool) -> bytes:
        """Give what is to be written of a part of the body.

        :raises RuntimeError: it is longer, or ends earlier, than the head says.
        """
        if self._bare:
            body = b""
        elif self._chunked:
            body = (b"%x\r\n%b\r\n" % (len(body), body) if body else b"") + (b"" if more else b"0\r\n\r\n")
        else:
            self._left -= len(body)
            if self._left < 0 or (self._left and not more):
                raise RuntimeError("An answer is not as long as it says.")
        self.over = not more
        return self._taken(body)

    def _taken(self, body: bytes) -> bytes:
        head, self._head = self._head, b""
        return head + body


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
        """True if it begins as soon as it has its turn on its connection, however many others ask."""
        self.keep_alive = keep_alive
        """True if the connection goes on after the answer."""
        self.has_turn = False
        """True if it may be answered: all before it are."""
        self.on_end: Callable[[], None] | None = None
        """Called when it has ended, in whatever way."""
        self.started = self._begun = False
        """True if it waits no more for its turn to begin; true if the application has it."""
        self.gone = False
        """True if its client waits for the answer no more."""
        self.body = RequestBody()
        self.answer = AnswerWriter(bare=scope["method"] == "HEAD")
        self._connection, self._app, self._scope = connection, app, scope
        self._continues = continues
        """True if the client waits for a word before it sends the body."""
        self._turn: asyncio.Event | None = None

    @property
    def undone(self) -> bool:
        """True if it is certain that nothing was done yet: it waits for its turn, or for its body."""
        return not self._begun or self.body.awaited

    @property
    def leaves_unread(self) -> bool:
        """True if it is answered for good before its body has come, so that more of it may be under way."""
        return self.body.more and not self.keep_alive

    def is_ahead_of_application(self, most: int) -> bool:
        """Tell if more bytes of its body have come than `most`, and the application is yet to take them."""
        return self.body.more and not self.answer.over and len(self.body.content) > most

    def give_up(self) -> None:
        """Its client has left, or it can never be read as a whole."""
        self.gone = self.gone or not self.answer.over
        self.body.wake()
        self.give_turn()

    def give_turn(self) -> None:
        """Let it be answered."""
        self.has_turn = True
        if self._turn is not None:
            self._turn.set()

    def take(self, body: bytes, *, more: bool) -> None:
        """Take a part of the body; more of an answered request is passed over."""
        if not self.answer.over:
            self.body.add(body, more=more)

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
        if not self.answer.over and not self.gone:
            await self._answer_instead()

    async def _answer_instead(self) -> None:
        """Answer for an application that did not, or end the connection in the middle of its answer."""
        if self.answer.begun:
            self._connection.transport.close()
            return
        text = b"Internal Server Error"
        headers = [(b"content-type", b"text/plain"), (b"content-length", b"%d" % len(text))]
        self.keep_alive = False
        await self._send({"type": "http.response.start", "status": 500, "headers": headers})
        await self._send({"type": "http.response.body", "body": text})

    async def _receive(self) -> Message:
        body = self.body
        if self._continues and not self._connection.transport.is_closing():
            self._connection.transport.write(_CONTINUE)
            self._continues = False
        if not (body.news or self.gone or self.answer.over):
            self._connection.read_on()
            await body.change()
        body.news = False
        # That its client has left since changes nothing for a stop that came as a whole.
        is_there = self.is_stop and not body.taken and not body.more
        if (self.gone or self.answer.over) and not is_there:
            body.taken = True
            return {"type": "http.disconnect"}
        return body.message()

    async def _send(self, message: Message) -> None:
        if not self.has_turn:
            self._turn = self._turn or asyncio.Event()
            await self._turn.wait()
        if (room := self._connection.flow.room) is not None and not self.gone:
            await room.wait()
        if self.gone:
            return
        if not self.answer.begun:
            self._begin_answer(message["status"], message.get("headers", ()))
        elif not self.answer.over:
            self._go_on(message.get("body", b""), more=message.get("more_body", False))
        else:
            raise RuntimeError("More was sent than an answer.")

    def _begin_answer(self, status: int, headers: Iterable[tuple[bytes, bytes]]) -> None:
        said = [*self._connection.default_headers, *headers]
        if (b"connection", b"close") in said:
            self.keep_alive = False
        elif not self.keep_alive:
            said.append((b"connection", b"close"))
        self._continues = False
        if first := self.answer.begin(status, said):
            self._connection.transport.write(first)

    def _go_on(self, body: bytes, *, more: bool) -> None:
        self._connection.transport.write(self.answer.go_on(body, more=more))
        if not more:
            self.body.wake()
            if not self.keep_alive and not self.leaves_unread:
                self._connection.transport.close()
            self._connection.on_answered()
