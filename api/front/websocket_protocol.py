"""WebSockets as uvicorn speaks them; whatever a client sends or does not read, its socket ends in time."""

import asyncio
import logging
from collections.abc import Callable, Sequence
from struct import pack
from typing import Any, ClassVar, Final, cast

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import CloseCode
from websockets.http11 import Request

from api.front.drain import Drain
from api.front.http_protocol import Limits
from api.front.refusals import Refused
from gateway.core.events import Event, Writer

_log = logging.getLogger(__name__)
"""That of uvicorn and websockets, whose lines below warnings have queries and headers, and so keys."""
_log.setLevel(logging.WARNING)

EVENTS: Final = "motion_gateway.events"
"""The ASGI extension by which an application writes events to a WebSocket: its `outlet`."""
SINGLY: Final = "cloudevents.json"
"""The subprotocol of one CloudEvent in each text frame."""
TOGETHER: Final = "cloudevents-batch.json"
"""The subprotocol of a JSON array in each text frame: all CloudEvents that are sent at once."""


class WebSocketProtocol(WebSocketsSansIOProtocol):
    """A connection, and the outlet of its events."""

    limits: ClassVar[Limits] = Limits()

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.logger = self.conn.logger = _log
        self.conn.debug = False
        self._in_use = False
        """Whether the application has it."""
        self.takes = True
        self.writer: Writer = _frames
        self.on_room: Callable[[], None] = _nobody_asks

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take it over from HTTP."""
        super().connection_made(transport)
        self.write: Callable[[bytes], None] = self.transport.write
        self._drain = Drain(cast("asyncio.Transport", transport), self.limits.stall_s)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget it."""
        self.takes = False
        self._drain.stop()
        super().connection_lost(exc)
        self._untie()

    def pause_writing(self) -> None:
        """The client does not take events as fast as they come."""
        super().pause_writing()
        self.takes = False
        self._drain.watch()

    def resume_writing(self) -> None:
        """It has taken most of them."""
        super().resume_writing()
        self._drain.stop()
        self.takes = True
        self.on_room()

    def handle_connect(self, event: Request) -> None:
        """Offer the outlet to the application."""
        super().handle_connect(event)
        if not self.close_sent:
            self.scope["extensions"][EVENTS] = {"outlet": self}
            self._in_use = True

    def data_received(self, data: bytes) -> None:
        """Answer a handshake, or take frames; what they say is not read."""
        super().data_received(data)
        if self.conn.handshake_exc is not None and not self.handshake_initiated:
            refused = Refused(431, "A header of the request is too long for a WebSocket, or it has too many.")
            self.transport.write(refused.answer(self.default_headers, "", ()))
            self._close()

    def send_receive_event_to_app(self) -> None:
        """Take a message; a text that is none is the client's mistake, and no error of the gateway."""
        if self.curr_msg_data_type == "text" and not self.close_sent and not _is_text(b"".join(self.frames)):
            self.frames = []
            self.conn.fail(CloseCode.INVALID_DATA, "text is not UTF-8")
            self.handle_parser_exception()
            return
        super().send_receive_event_to_app()

    def handle_parser_exception(self) -> None:
        """Close with the code of what the client has done wrong."""
        if self.conn.close_sent is None:  # frames before the handshake was answered
            self.transport.abort()
            return
        super().handle_parser_exception()
        self._drain.watch()

    def keepalive_timeout(self) -> None:
        """Close; the client has not answered for long, and will not take what it is sent."""
        super().keepalive_timeout()
        self._drain.watch()

    def shutdown(self) -> None:
        """Close, because the gateway ends."""
        super().shutdown()
        self._drain.watch()

    async def send(self, message: Any) -> None:
        """Send for the application; an answer that refuses the handshake is one to it, too."""
        if message["type"] == "websocket.accept" and message.get("subprotocol") == TOGETHER:
            self.writer = _frame_of_all
        await super().send(message)
        if message["type"] == "websocket.accept" and self.handshake_complete:
            del self.request, self.response  # kilobytes for each client that stays
        if message["type"] == "websocket.http.response.body" and not message.get("more_body", False):
            self.handshake_complete = True
        if self.close_sent:
            self._drain.watch()

    def on_task_complete(self, task: asyncio.Task[None]) -> None:
        """The application has done with it."""
        super().on_task_complete(task)
        self.scope["extensions"].clear()
        self._in_use = False
        self._untie()

    def _untie(self) -> None:
        """Leave nothing to the garbage collector: it holds the loop for 100 ms when a thousand have left."""
        if self.disconnected and not self._in_use:
            self.conn.parser.close()

    def _close(self) -> None:
        self.transport.close()
        self._drain.watch()


def _is_text(data: bytes) -> bool:
    try:
        data.decode()
    except UnicodeDecodeError:
        return False
    return True


def _nobody_asks() -> None:
    """Nothing is to be sent."""


def _frames(events: Sequence[Event]) -> bytes:
    """Write text frames as a server does: whole, and not masked (RFC 6455 5.2)."""
    return b"".join(_frame(event.json) for event in events)


def _frame_of_all(events: Sequence[Event]) -> bytes:
    return _frame(f"[{','.join(event.json for event in events)}]")


def _frame(content: str) -> bytes:
    text = content.encode()
    size = len(text)
    if size < 126:
        head = pack("!BB", 0x81, size)
    elif size < 65_536:
        head = pack("!BBH", 0x81, 126, size)
    else:
        head = pack("!BBQ", 0x81, 127, size)
    return head + text
