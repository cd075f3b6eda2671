"""WebSockets as uvicorn speaks them; whatever a client sends or does not read, its socket ends in time."""

import asyncio
import logging
from collections.abc import Callable, Sequence
from struct import pack
from typing import Any, ClassVar, Final, cast

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import CloseCode
from websockets.http11 import Request

from api.front import certificates
from api.front.drain import Drain
from api.front.intake import Inlet, Intake, Rate
from api.front.limits import LINGER_S, Limits
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
    intake: ClassVar[Intake]

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.logger = self.conn.logger = _log
        self.conn.debug = False
        self._in_use = False
        """Whether the application has it."""
        self.takes = True
        self.writer: Writer = _frames
        self.on_room: Callable[[], None] = _nobody_asks
        self._inlet = Inlet(self.intake, self.limits.piece_bytes, self._parse, self._hold)
        self._rate = Rate(self.limits.frames_per_s)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take it over from HTTP."""
        super().connection_made(transport)
        self.write: Callable[[bytes], None] = self.transport.write
        self._drain = Drain(cast("asyncio.Transport", transport), self.limits.stall_s)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget it."""
        self._inlet.end()
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
            certificates.note(self.scope, certificates.common_name(self.transport))
            self.scope["extensions"][EVENTS] = {"outlet": self}
            self._in_use = True

    def data_received(self, data: bytes) -> None:
        """Parse it in pieces that are soon parsed; others have their turn in between."""
        self._inlet.take(data)

    def _hold(self, held: bool) -> None:  # as the inlet calls it
        if not self.transport.is_closing():
            (self.transport.pause_reading if held else self.transport.resume_reading)()

    def _parse(self, piece: bytes) -> None:
        """Answer a handshake, or take frames; what they say is not read."""
        if self.transport.is_closing():
            self._inlet.pass_over()
            return
        super().data_received(piece)
        if self.conn.handshake_exc is not None and not self.handshake_initiated:
            refused = Refused(431, "A header of the request is too long for a WebSocket, or it has too many.")
            self.transport.write(refused.answer(self.default_headers, "", ()))
            self._close()

    def handle_events(self) -> None:
        """Take what was parsed; a client that sends more than it can have to say is told so, and leaves."""
        if self.handshake_complete and self._rate.is_exceeded(len(self.conn.events)):
            self._end_for_its_frames()
        else:
            super().handle_events()

    def _end_for_its_frames(self) -> None:
        most = self.limits.frames_per_s
        self.conn.fail(CloseCode.POLICY_VIOLATION, f"more than {most} frames in a second")
        self.queue.put_nowait({"type": "websocket.disconnect", "code": CloseCode.POLICY_VIOLATION})
        self.transport.write(b"".join(self.conn.data_to_send()))
        self.close_sent = True
        self.stop_keepalive()
        self._inlet.pass_over()
        # It may lose the reason if it still sends when the connection is closed.
        self.close_timer = self.loop.call_later(LINGER_S, self._close)

    def send_receive_event_to_app(self) -> None:
        """Pass a message over; a text that is none is the client's mistake, and no error of the gateway."""
        message, self.frames = b"".join(self.frames), []
        if self.curr_msg_data_type == "text" and not self.close_sent and not _is_text(message):
            self.conn.fail(CloseCode.INVALID_DATA, "text is not UTF-8")
            self.handle_parser_exception()

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
            self.conn.parser_exc = None

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
