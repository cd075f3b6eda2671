"""Requests of a connection that are not answered yet."""

import asyncio
from collections.abc import Callable
from typing import Any

from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.httptools_impl import RequestResponseCycle


class PendingRequest:
    """A request as the application sees it: begun at its turn, a stop at once; answered at its turn."""

    def __init__(
        self, app: ASGIApp, cycle: RequestResponseCycle, *, is_stop: bool, is_urgent: bool = False
    ) -> None:
        self.cycle = cycle
        self.is_stop = is_stop
        self.is_urgent = is_urgent
        """Whether it begins as soon as it has its turn on its connection, however many others ask."""
        self.has_turn = False
        """Whether it may be answered: all before it are."""
        self._turn: asyncio.Event | None = None
        self.on_end: Callable[[], None] | None = None
        """Called when it has ended, in whatever way."""
        self.started = False
        self.leaves_unread = False
        """Whether it was answered for good before its body had come, so that more of it may be under way."""
        self._app = app
        self._begun = False
        self._taken = False
        self._waits_for_body = False

    @property
    def undone(self) -> bool:
        """Whether it is certain that nothing was done yet: it waits for its turn, or for its body."""
        return not self._begun or self._waits_for_body

    def give_up(self) -> None:
        """Its client has left, or it can never be read as a whole."""
        if not self.cycle.response_complete:
            self.cycle.disconnected = True
        self.cycle.message_event.set()
        self.give_turn()

    def give_turn(self) -> None:
        """Let it be answered."""
        self.has_turn = True
        if self._turn is not None:
            self._turn.set()

    async def _wait_for_turn(self) -> None:
        if not self.has_turn:
            self._turn = self._turn or asyncio.Event()
            await self._turn.wait()

    async def __call__(self, scope: Scope, _receive: Receive, _send: Send) -> None:
        """Do what is asked for; nothing, where the client has left before, unless it is a stop."""
        try:
            if self.is_stop or not self.cycle.disconnected:
                self._begun = True
                await self._app(scope, self._receive, self._send)
        except Exception:
            await self._wait_for_turn()
            raise
        finally:
            if self.on_end is not None:
                self.on_end()

    async def _receive(self) -> Message:
        self._waits_for_body = not self._taken
        try:
            message: Any = await self.cycle.receive()
        finally:
            self._waits_for_body = False
        if message["type"] == "http.disconnect" and self._has_all_of_a_stop():
            # That its client has left since changes nothing.
            message = {"type": "http.request", "body": bytes(self.cycle.body), "more_body": False}
        self._taken = not message.get("more_body", False)
        result: Message = message
        return result

    def _has_all_of_a_stop(self) -> bool:
        return self.is_stop and not self._taken and not self.cycle.more_body

    @staticmethod
    def _is_last(message: Message) -> bool:
        return message["type"] == "http.response.body" and not message.get("more_body", False)

    async def _send(self, message: Message) -> None:
        if not self.has_turn:
            await self._wait_for_turn()
        if self._is_last(message) and self.cycle.more_body and not self.cycle.keep_alive:
            self.leaves_unread = True
            self.cycle.keep_alive = True  # uvicorn would close at once
        await self.cycle.send(message)  # type: ignore[arg-type]  # two names for the same dictionaries
