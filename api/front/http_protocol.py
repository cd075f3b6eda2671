"""HTTP/1.1 in front of an ASGI application, with bounds: no client makes the event loop work for long.

Bytes are parsed by httptools. A request behind another that is not answered yet waits for its
turn, and is not begun once its client has left. Stops do not wait: they are begun as soon as their head has
come, and only their answers keep the order.
"""

import asyncio
from collections import deque
from functools import partial
from itertools import takewhile
from typing import ClassVar, Final
from urllib.parse import quote

import httptools
import uvicorn
from starlette.types import Scope
from uvicorn.server import ServerState

from api.front.connections import LINGER_S, Admitted, ConnectionLimit, ConnectionLimits
from api.front.flow import Flow, RestTimer, Timer
from api.front.intake import Inlet, Intake
from api.front.pending_requests import PendingRequest
from api.front.refusals import Refused, refusal_in
from api.front.request_head import ConnectionScope, RequestHead
from api.front.turnstile import Turnstile
from api.front.websocket_protocol import WebSocketProtocol

_INSTANCE_BYTES = 200
_ENOUGH_BYTES: Final = 65_536
"""Bytes of a body that are read ahead of the application."""
FULL: Final = "All connections of the gateway are in use, and only stops and /livez are served beyond them."


class HttpProtocol(asyncio.Protocol):
    """A connection, as `uvicorn.Config(http=...)` takes it."""

    limits: ClassVar[ConnectionLimits] = ConnectionLimits()
    connection_limit: ClassVar[ConnectionLimit]
    turnstile: ClassVar[Turnstile]
    intake: ClassVar[Intake]
    websocket: ClassVar[type[WebSocketProtocol]]

    transport: asyncio.Transport
    flow: Flow

    def __init__(self, config: uvicorn.Config, server_state: ServerState, **_: object) -> None:
        self._config, self._server = config, server_state
        self._parser = self._new_parser()
        self._admitted = Admitted.EVERYTHING
        self._head = RequestHead()
        """The head that came last, or comes now."""
        self._under_way: deque[PendingRequest] = deque()
        """Requests that are not answered yet, in their order; the first has its turn."""
        self._refusal: bytes | None = None
        """The answer that ends the connection when all requests under way were answered."""
        self._inlet = Inlet(self.intake, self.limits.piece_bytes, self._parse, self._hold)
        self._quiet_bytes = 0
        """Parsed since something last came of it: a head, a part of a body, or the end of a request."""
        self._deadline, self._rest = Timer(), RestTimer()
        """End a connection on which a request does not come as a whole, or on which nothing is asked for."""

    # the connection

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # it is a socket's
        """Decide what may be asked for."""
        self.transport = transport
        self._server.connections.add(self)  # type: ignore[arg-type]  # uvicorn names its own
        self._scopes = ConnectionScope(transport, self._config.root_path)
        self.flow = Flow(transport, self.limits.stall_s)
        self._admitted = self.connection_limit.admit(self, len(self._server.connections))
        if self._admitted is Admitted.NOTHING:
            transport.abort()

    def connection_lost(self, _: Exception | None) -> None:
        """Begin nothing more that was asked for here."""
        self._inlet.end()
        self._give_up_all()
        self._end_receiving()
        self._rest.cancel()
        self.connection_limit.leave(self)
        self._server.connections.discard(self)
        self.flow.resume()
        self._under_way.clear()
        self._head.request = None  # and with it a circle, as with the parser
        del self._parser

    def eof_received(self) -> None:
        """Do as if the client had left altogether."""
        self._give_up_all()

    def give_way(self) -> None:
        """End at once: others need the place."""
        self._server.connections.discard(self)
        self.transport.abort()

    def shutdown(self) -> None:
        """Answer what was begun, and nothing behind it."""
        if self._under_way:
            self._under_way[0].keep_alive = self._under_way[-1].keep_alive = False
        else:
            self.transport.close()

    def pause_writing(self) -> None:
        """The client does not take its answer as fast as it comes."""
        self.flow.pause()

    def resume_writing(self) -> None:
        """It has taken most of it."""
        self.flow.resume()

    def _give_up_all(self) -> None:
        for request in self._under_way:
            request.give_up()

    @property
    def default_headers(self) -> list[tuple[bytes, bytes]]:
        """The headers that the server gives to all answers."""
        return self._server.default_headers

    # what comes in

    def data_received(self, data: bytes) -> None:
        """Parse it in pieces that are soon parsed; others have their turn in between."""
        if self._refusal is None:
            self._rest.end()
            self.connection_limit.ask(self)
        self._inlet.take(data)

    def _new_parser(self) -> httptools.HttpRequestParser:
        """Make one that goes on after a request with `Connection: close`, as long as that is not answered."""
        parser = httptools.HttpRequestParser(self)
        parser.set_dangerous_leniencies(lenient_data_after_close=True)
        return parser

    def _parse(self, piece: bytes) -> None:
        if self.transport.is_closing():
            self._inlet.pass_over()
            return
        room = self.limits.head_bytes - self._quiet_bytes
        if len(piece) > room:
            self._inlet.put_back(piece[room:])
            piece = piece[:room]
        self._quiet_bytes += len(piece)
        self._head.receiving = True
        try:
            self._parser.feed_data(piece)
        except httptools.HttpParserUpgrade as upgrade:
            self._upgrade(piece[upgrade.args[0] :])
        except httptools.HttpParserError as error:
            self._refuse(refusal_in(error))
        else:
            self._parse_on()

    def _parse_on(self) -> None:
        if self._quiet_bytes >= self.limits.head_bytes:
            self._refuse(Refused(431, f"The request's head is over {self.limits.head_bytes} bytes."))
        elif self._head.receiving:
            self._start_deadline()

    def _hold(self, held: bool) -> None:  # as the inlet calls it
        if held or self._refusal is None:
            self.flow.held = held
            self.read_on()

    def read_on(self) -> None:
        """Read, unless there is enough to parse, or of a body that the application has not taken."""
        request = self._head.request
        enough = request is not None and request.is_ahead_of_application(_ENOUGH_BYTES)
        self.flow.read(enough=enough)

    def _upgrade(self, rest: bytes) -> None:
        """Hand a WebSocket over; read what offers another protocol as if it did not (RFC 9110 7.8)."""
        if self._head.opens_websocket:
            self._end_receiving()
            self._inlet.pass_over()
            self.connection_limit.leave(self)
            self.turnstile.enter(self._hand_over)
            return
        # The parser takes no body of a request that offers a protocol, though it may have one.
        self._inlet.put_back(self._head.again(self._parser, but=b"upgrade") + rest)
        self._quiet_bytes = 0
        self._parser = self._new_parser()
        self._parse_on()

    def _hand_over(self) -> None:
        """Give the connection to a WebSocket, unless it has ended meanwhile."""
        self.turnstile.leave()
        if self.transport.is_closing():
            return
        self.flow.stop()
        self._inlet.end()
        self._rest.cancel()
        self.flow.held = False
        self.read_on()
        self._server.connections.discard(self)
        socket = self.websocket(self._config, self._server)
        self.transport.set_protocol(socket)
        socket.connection_made(self.transport)
        socket.open(self._head.opens, self._head.again(self._parser))
        del self._parser  # and with it a circle

    # what the parser finds; what is raised here comes out of `feed_data`

    def on_message_begin(self) -> None:
        """Begin a request."""
        self._head = RequestHead()

    def on_url(self, url: bytes) -> None:
        """Take a part of the target."""
        self._head.url += url

    def on_header(self, name: bytes, value: bytes) -> None:
        """Take a header; one that comes behind a chunked body is none (RFC 9110 6.5.1)."""
        if not self._head.in_body:
            self._head.take(name, value, self.limits.head_lines)

    def on_headers_complete(self) -> None:
        """Begin what has its turn."""
        self._quiet_bytes = 0
        head, version = self._head, self._parser.get_http_version()
        method = self._parser.get_method().decode("ascii")
        head.complete(method, version)
        self._require_room()
        head.in_body = not self._parser.should_upgrade()
        if head.in_body:
            self._queue({**self._scopes.of("http", head, version), "method": method})
            self.read_on()
        elif head.opens_websocket:
            head.require_good_handshake(method, version, ahead=bool(self._under_way))
            head.opens = self._scopes.of("websocket", head, version)

    def on_body(self, body: bytes) -> None:
        """Take a part of a body."""
        self._quiet_bytes = 0
        if (request := self._head.request) is not None:
            request.take(body, more=True)
            self.read_on()

    def on_message_complete(self) -> None:
        """The request has come as a whole."""
        self._quiet_bytes = 0
        self._end_receiving()
        if (request := self._head.request) is not None:
            request.take(b"", more=False)
            self.read_on()

    def _require_room(self) -> None:
        if self._admitted is Admitted.STOPS and not (self._head.is_stop or self._head.is_life_sign):
            raise Refused(503, FULL)
        most = self.limits.requests_ahead
        if len(self._under_way) >= (2 * most if self._head.is_stop else most):
            raise Refused(503, f"More than {most} requests were sent ahead of an answer.")

    # requests under way

    def _queue(self, scope: Scope) -> None:
        head = self._head
        head.request = request = PendingRequest(
            self,
            self._config.loaded_app,
            scope,
            keep_alive=scope["http_version"] != "1.0" and self._parser.should_keep_alive(),
            continues=head.expects_continue,
            is_stop=head.is_stop,
            is_urgent=head.is_urgent,
        )
        self._under_way.append(request)
        if self._admitted is Admitted.STOPS:
            request.keep_alive = False
            if request.is_stop:
                self.connection_limit.stop(self)
        if request is self._under_way[0]:
            request.give_turn()
        if request.is_stop or request.has_turn:
            self._begin(request)

    def _begin(self, request: PendingRequest) -> None:
        """Begin what has its turn: what is urgent at once, the rest as the turnstile lets it."""
        request.started = True
        begin = partial(self._start, request)
        if request.is_stop:
            request.on_end = self.turnstile.end_stop
            self.turnstile.begin_stop()
            begin()
        elif request.is_urgent:
            begin()
        else:
            request.on_end = self.turnstile.leave
            self.turnstile.enter(begin)

    def _start(self, request: PendingRequest) -> None:
        task = asyncio.get_running_loop().create_task(request.run())
        self._server.tasks.add(task)
        task.add_done_callback(self._server.tasks.discard)

    def on_answered(self) -> None:
        """Let the next request have its turn."""
        answered = self._under_way.popleft()
        self._server.total_requests += 1
        if self.transport.is_closing():
            self.flow.watch()
        elif answered.leaves_unread:
            self._refusal = b""
            self._inlet.pass_over()
            self._end_receiving()
            self._send_refusal()
        elif self._under_way:
            self._restart_deadline()
            self.read_on()
            first = self._under_way[0]
            first.give_turn()
            if not first.started:
                self._begin(first)
        elif self._refusal is not None:
            self._send_refusal()
        else:
            self.read_on()
            self._rest.begin(self._config.timeout_keep_alive, self.transport.close)
            self._restart_deadline()
            self.connection_limit.rest(self)

    # requests that are refused, or do not come

    def _start_deadline(self) -> None:
        if not self._deadline.is_due:
            self._deadline.start(self.limits.receive_s, self._too_slow)

    def _restart_deadline(self) -> None:
        """Give a request that came behind another its own time, now that the other is answered."""
        if self._deadline.cancel():
            self._start_deadline()

    def _end_receiving(self) -> None:
        self._head.receiving = False
        self._deadline.cancel()

    def _too_slow(self) -> None:
        if self.transport.is_closing():
            return
        last = self._under_way[-1] if self._under_way else None
        if last is None or (len(self._under_way) == 1 and self._head.in_body and last.undone):
            self._refuse(Refused(408, f"The request did not come as a whole in {self.limits.receive_s:g} s."))
        else:
            self._start_deadline()

    def _refuse(self, refused: Refused) -> None:
        """End the connection with an answer; before it comes what was begun, and nothing that was not."""
        path = quote(self._head.path[:_INSTANCE_BYTES], safe="/%")
        answer = refused.answer(self.default_headers, path, self._head.lines)
        self._refusal = b"" if self._head.in_body and not self._take_back() else answer
        self._end_receiving()
        self._inlet.pass_over()
        self.flow.held = True
        self.read_on()
        begun = len(list(takewhile(lambda request: request.started, self._under_way)))
        while len(self._under_way) > begun:
            self._under_way.pop().give_up()
        if not self._under_way:
            self._send_refusal()

    def _take_back(self) -> bool:
        """Give up the request whose body is coming, if nothing was done yet because of it."""
        last = self._under_way[-1] if self._under_way else None
        if last is None or not last.undone or last.answer.begun:
            return False
        self._under_way.pop()
        last.give_up()
        return True

    def _send_refusal(self) -> None:
        """Answer, and close a moment later: a client that still sends then may lose the answer."""
        self.transport.write(self._refusal or b"")
        if self.transport.can_write_eof():  # not over TLS
            self.transport.write_eof()
        self.flow.held, self._head.request = False, None
        self.read_on()
        asyncio.get_running_loop().call_later(LINGER_S, self._close)

    def _close(self) -> None:
        self.transport.close()
        self.flow.watch()


DEFAULT = ConnectionLimits()


def protocols(max_connections: int, bounds: ConnectionLimits = DEFAULT) -> type[HttpProtocol]:
    """Make the protocol of one server, whose connections share one limit; it hands WebSockets over."""
    entering = Turnstile()
    shared = Intake(bounds, entering)

    class WebSocket(WebSocketProtocol):
        limits = bounds
        intake = shared

    class Http(HttpProtocol):
        limits = bounds
        connection_limit = ConnectionLimit(max_connections)
        turnstile = entering
        intake = shared
        websocket = WebSocket

    return Http
