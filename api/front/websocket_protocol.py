"""WebSockets in front of an ASGI application; whatever a client sends or does not read, its socket ends.

The protocol itself is that of `websockets`, without its input and output.
"""

import asyncio
import logging
from collections.abc import Callable, Sequence
from secrets import token_bytes
from struct import pack
from typing import Any, ClassVar, Final

import uvicorn
from starlette.types import Message
from uvicorn.server import ServerState
from websockets.exceptions import InvalidState
from websockets.frames import Close, CloseCode, Frame, Opcode
from websockets.http11 import Request, Response
from websockets.protocol import SEND_EOF, State
from websockets.server import ServerProtocol

from api.front.connections import LINGER_S, ConnectionLimits
from api.front.flow import Flow, Timer
from api.front.intake import Frequency, Inlet, Intake
from api.front.refusals import Refused, head_of
from gateway.door.events import Event, Writer

_log = logging.getLogger(__name__)
"""The log of websockets, too, whose lines below warnings have queries and headers, and so keys."""
_log.setLevel(logging.WARNING)

EVENTS: Final = "motion_gateway.events"
"""The ASGI extension by which an application writes events to a WebSocket: its `outlet`."""
SINGLY: Final = "cloudevents.json"
"""The subprotocol of one CloudEvent in each text frame."""
TOGETHER: Final = "cloudevents-batch.json"
"""The subprotocol of a JSON array in each text frame: all CloudEvents that are sent at once."""
CLOSE_S: Final = 10.0
"""Seconds that a client may take to say that it closes, too."""
PING_BYTES: Final = 4


class ClientLeft(OSError):
    """The application has sent something to a client that is not there any more."""


class EventOutlet:
    """The way for events to the client of a WebSocket (`EventSink`)."""

    def __init__(self, write: Callable[[bytes], None]) -> None:
        self.write = write
        self.takes = True
        self.writer: Writer = _frames
        self.on_room: Callable[[], None] = _nobody_asks


class Handshake:
    """The answer to the request for a WebSocket."""

    def __init__(self) -> None:
        self.acceptance: Response | None = None
        """The response that opens it, until that is sent."""
        self.denial: list[Any] = []
        """Status, headers and body of what refuses it."""
        self.answered = False


class HeardFrames:
    """The frames of a client: they are counted, and their texts are checked, and not read."""

    def __init__(self, most_per_s: int) -> None:
        self.most_per_s = most_per_s
        self._rate = Frequency(most_per_s)
        self._text: list[bytes] | None = None
        """The fragments of a text that has begun."""

    def are_too_many(self, frames: int) -> bool:
        """Count frames that have come; tell whether that was too often in this second."""
        return self._rate.is_exceeded(frames)

    def is_good(self, frame: Frame) -> bool:
        """Tell whether a part of a text, if it ends one, leaves it UTF-8."""
        if frame.opcode is Opcode.TEXT:
            self._text = []
        if self._text is None:
            return True
        self._text.append(bytes(frame.data))
        if not frame.fin:
            return True
        text, self._text = b"".join(self._text), None
        return _is_text(text)


class WebSocketProtocol(asyncio.Protocol):
    """A connection that was taken over from HTTP."""

    limits: ClassVar[ConnectionLimits] = ConnectionLimits()
    intake: ClassVar[Intake]

    transport: asyncio.Transport

    def __init__(self, config: uvicorn.Config, server_state: ServerState) -> None:
        self._config, self._server = config, server_state
        self._conn = ServerProtocol(max_size=config.ws_max_size, logger=_log)
        self._told: asyncio.Queue[Message] = asyncio.Queue()
        """The messages that the application is to receive."""
        self._handshake = Handshake()
        self._closes = self._lost = self._in_use = False
        """True if the end has begun; if it is over; if the application has it."""
        self._timer = Timer()
        """The timer of the next ping, of its pong, or of the end."""
        self._ping = b""
        self._inlet = Inlet(self.intake, self.limits.piece_bytes, self._parse, self._hold)
        self._heard = HeardFrames(self.limits.frames_per_s)

    # the connection

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # it is a socket's
        """Take it over from HTTP."""
        self.transport = transport
        self._server.connections.add(self)  # type: ignore[arg-type]  # uvicorn names its own
        self._outlet = EventOutlet(transport.write)
        self._flow = Flow(transport, self.limits.stall_s)

    def open(self, scope: dict[str, Any], head: bytes) -> None:
        """Answer a request that was found good; the application decides whether it is opened."""
        self._conn.receive_data(head)
        asked = self._conn.events_received()
        if not asked:
            refused = Refused(431, "A header of the request is too long for a WebSocket, or it has too many.")
            self.transport.write(refused.answer(self._server.default_headers, "", ()))
            self._close()
            return
        assert isinstance(asked[0], Request)  # noqa: S101  # nothing else comes first
        self._handshake.acceptance = self._conn.accept(asked[0])
        offered = b",".join(value for name, value in scope["headers"] if name == b"sec-websocket-protocol")
        scope["subprotocols"] = [
            protocol.strip() for protocol in offered.decode("latin-1").split(",") if protocol.strip()
        ]
        scope["extensions"] = {"websocket.http.response": {}, EVENTS: {"outlet": self._outlet}}
        self._in_use = True
        self._told.put_nowait({"type": "websocket.connect"})
        task = asyncio.get_running_loop().create_task(self._run(scope))
        self._server.tasks.add(task)
        task.add_done_callback(self._server.tasks.discard)

    async def _run(self, scope: dict[str, Any]) -> None:
        try:
            await self._config.loaded_app(scope, self._told.get, self._send)
        except ClientLeft:
            pass
        except Exception:
            _log.exception("A WebSocket has failed.")
        finally:
            scope["extensions"].clear()
            self._in_use = False
            self._end()
            self._untie()

    def _end(self) -> None:
        """End a connection that the application has done with."""
        if not self._handshake.answered and not self._lost:
            self._refuse(500)
        if not self._closes:
            self._close()

    def connection_lost(self, _: Exception | None) -> None:
        """Forget it."""
        self._inlet.end()
        self._outlet.takes, self._lost = False, True
        self._timer.cancel()
        self._tell_end(CloseCode.NO_STATUS_RCVD if self._handshake.answered else CloseCode.ABNORMAL_CLOSURE)
        self._server.connections.discard(self)
        self._flow.resume()
        self._untie()

    def _untie(self) -> None:
        """Leave nothing to the garbage collector: it holds the loop for 100 ms when a thousand have left."""
        if self._lost and not self._in_use:
            vars(self._conn).clear()

    def pause_writing(self) -> None:
        """The client does not take events as fast as they come."""
        self._flow.pause()
        self._outlet.takes = False

    def resume_writing(self) -> None:
        """It has taken most of them."""
        self._flow.resume()
        self._outlet.takes = True
        self._outlet.on_room()

    def shutdown(self) -> None:
        """Close, because the gateway ends."""
        if not self._handshake.answered:
            self._refuse(500)
        elif not self._closes:
            self._say_close(CloseCode.SERVICE_RESTART)
        self._close()

    # what comes in

    def data_received(self, data: bytes) -> None:
        """Parse it in pieces that are soon parsed; others have their turn in between."""
        self._inlet.take(data)

    def _hold(self, held: bool) -> None:  # as the inlet calls it
        self._flow.held = held
        self._flow.read()

    def _parse(self, piece: bytes) -> None:
        """Take frames; what they say is not read."""
        if self.transport.is_closing():
            self._inlet.pass_over()
            return
        self._conn.receive_data(piece)
        frames = self._conn.events_received()
        if self._handshake.answered and self._heard.are_too_many(len(frames)):
            self._end_for_its_frames()
            return
        for frame in frames:
            if isinstance(frame, Frame):
                self._take(frame)
        if self._conn.state is State.CONNECTING:
            if SEND_EOF in self._conn.data_to_send():  # frames before the handshake was answered
                self.transport.abort()
        elif self._flush():
            self._tell_end(CloseCode.PROTOCOL_ERROR)
            self._close()

    def _take(self, frame: Frame) -> None:
        if frame.opcode is Opcode.PONG and self._ping and bytes(frame.data) == self._ping:
            self._wait_to_ping()
        elif frame.opcode is Opcode.CLOSE and not self._closes:
            self._tell_end(Close.parse(frame.data).code)
        elif (
            frame.opcode in (Opcode.TEXT, Opcode.CONT) and not self._closes and not self._heard.is_good(frame)
        ):
            # It is the client's mistake, and no error of the gateway.
            self._conn.fail(CloseCode.INVALID_DATA, "text is not UTF-8")

    def _end_for_its_frames(self) -> None:
        """Tell a client that sends more than it can have to say, and leave."""
        self._conn.fail(CloseCode.POLICY_VIOLATION, f"more than {self._heard.most_per_s} frames in a second")
        self._closes = True
        self._flush()
        self._tell_end(CloseCode.POLICY_VIOLATION)
        self._inlet.pass_over()
        # It may lose the reason if it still sends when the connection is closed.
        self._timer.start(LINGER_S, self._close)

    # pings

    def _wait_to_ping(self) -> None:
        self._ping = b""
        if self._config.ws_ping_interval:
            self._timer.start(self._config.ws_ping_interval, self._send_ping)

    def _send_ping(self) -> None:
        self._ping = token_bytes(PING_BYTES)
        self._conn.send_ping(self._ping)
        self._flush()
        self._timer.start(self._config.ws_ping_timeout or CLOSE_S, self._end_in_silence)

    def _end_in_silence(self) -> None:
        """Close; the client has not answered for long, and will not take what it is sent."""
        self._conn.fail(CloseCode.INTERNAL_ERROR, "keepalive ping timeout")
        self._flush()
        self._tell_end(CloseCode.INTERNAL_ERROR)
        self._close()

    # what goes out

    async def _send(self, message: Message) -> None:
        """Send for the application; an answer that refuses the handshake is one to it, too."""
        if (room := self._flow.room) is not None:
            await room.wait()
        if self._lost:
            raise ClientLeft
        kind = message["type"]
        if kind == "websocket.accept":
            self._accept(message)
        elif kind == "websocket.send":
            self._send_frame(message)
        elif kind == "websocket.close" and self._handshake.answered:
            self._say_close(message.get("code", CloseCode.NORMAL_CLOSURE), message.get("reason") or "")
        elif kind == "websocket.close":
            self._refuse(403)
        elif kind == "websocket.http.response.start":
            self._handshake.denial = [message["status"], list(message.get("headers", ())), b""]
        else:
            self._handshake.denial[2] += message.get("body", b"")
            if not message.get("more_body", False):
                self._refuse(*self._handshake.denial)

    def _accept(self, message: Message) -> None:
        acceptance, self._handshake.acceptance = self._handshake.acceptance, None  # kilobytes for each client
        if acceptance is None or self.transport.is_closing():
            return
        headers = acceptance.headers
        del headers["Date"]
        for name, value in (*self._server.default_headers, *message.get("headers", ())):
            headers[name.decode("latin-1")] = value.decode("latin-1")
        if subprotocol := message.get("subprotocol"):
            headers["Sec-WebSocket-Protocol"] = subprotocol
            self._outlet.writer = _frame_of_all if subprotocol == TOGETHER else _frames
        self._handshake.answered = True
        self._conn.send_response(acceptance)
        self._flush()
        self._wait_to_ping()

    def _send_frame(self, message: Message) -> None:
        try:
            if (text := message.get("text")) is not None:
                self._conn.send_text(text.encode())
            else:
                self._conn.send_binary(message["bytes"])
        except InvalidState:
            raise ClientLeft from None
        self._flush()

    def _refuse(self, status: int, headers: Sequence[tuple[bytes, bytes]] = (), body: bytes = b"") -> None:
        """Answer the handshake as a request that is refused."""
        length = (b"content-length", b"%d" % len(body))
        own = [(name, value) for name, value in headers if name not in (b"content-length", b"connection")]
        said = [*self._server.default_headers, *own, length, (b"connection", b"close")]
        self.transport.write(head_of(status, said) + body)
        self._handshake.answered = True
        self._tell_end(CloseCode.ABNORMAL_CLOSURE)
        self._close()

    def _say_close(self, code: int, reason: str = "") -> None:
        if self._closes or self.transport.is_closing():
            return
        self._tell_end(code)
        self._conn.send_close(code, reason)
        self._closes = True
        self._flush()
        self._timer.start(CLOSE_S, self._close)
        self._flow.watch()

    def _tell_end(self, code: int) -> None:
        self._told.put_nowait({"type": "websocket.disconnect", "code": int(code)})

    def _flush(self) -> bool:
        """Send what the protocol has to say; tell whether the connection ends with it."""
        said = self._conn.data_to_send()
        if data := b"".join(said):
            self.transport.write(data)
        return SEND_EOF in said

    def _close(self) -> None:
        self._closes = True
        self._timer.cancel()
        self.transport.close()
        self._flow.watch()


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
