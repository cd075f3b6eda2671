"""HTTP/1.1 in front of an ASGI application, with bounds: no client makes the event loop work for long.

Bytes are parsed by httptools. What is asked for behind a request that is not answered yet waits for its
turn, and is not begun once its client has left. Stops do not wait: they are begun as soon as their head has
come, and only their answers keep the order.
"""

import asyncio
import re
from collections import deque
from functools import partial
from itertools import takewhile
from typing import Any, ClassVar, Final
from urllib.parse import quote, unquote

import httptools
import uvicorn
from uvicorn.server import ServerState

from api.front import certificates
from api.front.connections import Admitted, ConnectionLimit
from api.front.drain import Drain
from api.front.intake import Inlet, Intake
from api.front.limits import LINGER_S, ConnectionLimits
from api.front.pending_requests import PendingRequest
from api.front.refusals import NOT_HTTP, Refused, refusal_in
from api.front.stop_paths import is_heartbeat, is_life_sign, is_stop
from api.front.turnstile import Turnstile
from api.front.websocket_protocol import WebSocketProtocol

_VERSIONS = ("1.1", "1.0")
_KEY = re.compile(rb"[A-Za-z0-9+/]{22}==")
_INSTANCE_BYTES = 200
_ENOUGH_BYTES: Final = 65_536
"""So much of a body is read ahead of the application."""
FULL: Final = "All connections of the gateway are in use, and only stops and /livez are served beyond them."


class HttpProtocol(asyncio.Protocol):
    """A connection, as `uvicorn.Config(http=...)` takes it."""

    limits: ClassVar[ConnectionLimits] = ConnectionLimits()
    connection_limit: ClassVar[ConnectionLimit]
    turnstile: ClassVar[Turnstile]
    intake: ClassVar[Intake]
    websocket: ClassVar[type[WebSocketProtocol]]

    transport: asyncio.Transport

    def __init__(self, config: uvicorn.Config, server_state: ServerState, **_: object) -> None:
        self._config, self._server = config, server_state
        self._drain: Drain
        self._parser = self._new_parser()
        self._admitted = Admitted.EVERYTHING
        self._under_way: deque[PendingRequest] = deque()
        """Requests that are not answered yet, in their order; the first has its turn."""
        self._coming: PendingRequest | None = None
        """The request whose head came last."""
        self._opened: dict[str, Any] = {}
        """What is known of a WebSocket that is being opened."""
        self._url = b""
        self._headers: list[tuple[bytes, bytes]] = []
        self._expects_continue = False
        self._refusal: bytes | None = None
        """What ends the connection when all that is under way was answered."""
        self._inlet = Inlet(self.intake, self.limits.piece_bytes, self._parse, self._hold)
        self._quiet_bytes = 0
        """Parsed since something last came of it: a head, a part of a body, or the end of a request."""
        self._receiving = False
        """Whether a request has begun to come and is not there as a whole."""
        self._in_body = False
        self._is_stop = self._is_life_sign = self._is_urgent = False
        """Of the request whose head came last."""
        self._held = self._paused = False
        """Whether there is enough to parse; whether the transport does not read."""
        self.room: asyncio.Event | None = None
        self._deadline: asyncio.TimerHandle | None = None
        self._rest: asyncio.TimerHandle | None = None
        """Ends a connection on which nothing is asked for."""

    # the connection

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # it is a socket's
        """Decide what may be asked for."""
        self.transport = transport
        self._server.connections.add(self)  # type: ignore[arg-type]  # uvicorn names its own
        encrypted = transport.get_extra_info("sslcontext") is not None
        self._place: dict[str, Any] = {
            "asgi": {"version": "3.0", "spec_version": "2.3"},
            "server": _address(transport.get_extra_info("sockname")),
            "client": _address(transport.get_extra_info("peername")),
            "root_path": self._config.root_path,
        }
        certificates.note(self._place, certificates.common_name(transport))
        self._schemes = (
            {"http": "https", "websocket": "wss"} if encrypted else {"http": "http", "websocket": "ws"}
        )
        self._drain = Drain(transport, self.limits.stall_s)
        self._admitted = self.connection_limit.admit(self, len(self._server.connections))
        if self._admitted is Admitted.NOTHING:
            transport.abort()

    def connection_lost(self, _: Exception | None) -> None:
        """Begin nothing more that was asked for here."""
        self._inlet.end()
        self._give_up_all()
        self._end_receiving()
        self._end_rest()
        self.connection_limit.leave(self)
        self._drain.stop()
        self._server.connections.discard(self)
        self._make_room()
        self._under_way.clear()
        self._coming = None  # and with it a circle, as with the parser
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
        self.room = self.room or asyncio.Event()
        self._drain.watch()

    def resume_writing(self) -> None:
        """It has taken most of it."""
        self._make_room()
        self._drain.stop()

    def _make_room(self) -> None:
        if self.room is not None:
            self.room.set()
            self.room = None

    def _give_up_all(self) -> None:
        for request in self._under_way:
            request.give_up()

    def _end_rest(self) -> None:
        if self._rest is not None:
            self._rest.cancel()
            self._rest = None

    @property
    def default_headers(self) -> list[tuple[bytes, bytes]]:
        """Those that the server gives to all answers."""
        return self._server.default_headers

    # what comes in

    def data_received(self, data: bytes) -> None:
        """Parse it in pieces that are soon parsed; others have their turn in between."""
        if self._refusal is None:
            self._end_rest()
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
        self._receiving = True
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
        elif self._receiving:
            self._start_deadline()

    def _hold(self, held: bool) -> None:  # as the inlet calls it
        if held or self._refusal is None:
            self._held = held
            self.read_on()

    def read_on(self) -> None:
        """Read, unless there is enough to parse, or of a body that the application has not taken."""
        it = self._coming
        enough = it is not None and it.more_body and not it.answered and len(it.body) > _ENOUGH_BYTES
        paused = self._held or enough
        if paused != self._paused and not self.transport.is_closing():
            self._paused = paused
            (self.transport.pause_reading if paused else self.transport.resume_reading)()

    def _upgrade(self, rest: bytes) -> None:
        """Hand a WebSocket over; read what offers another protocol as if it did not (RFC 9110 7.8)."""
        if self._opens_websocket():
            self._end_receiving()
            self._inlet.pass_over()
            self.connection_limit.leave(self)
            self.turnstile.enter(self._hand_over)
            return
        # The parser takes no body of a request that offers a protocol, though it may have one.
        self._inlet.put_back(self._head_again(but=b"upgrade") + rest)
        self._quiet_bytes = 0
        self._parser = self._new_parser()
        self._parse_on()

    def _head_again(self, but: bytes = b"") -> bytes:
        version = self._parser.get_http_version().encode()
        lines = [b"%b: %b" % header for header in self._headers if header[0] != but]
        return b"\r\n".join(
            [self._parser.get_method() + b" " + self._url + b" HTTP/" + version, *lines, b"", b""]
        )

    def _opens_websocket(self) -> bool:
        """Whether a request that offers another protocol offers this one."""
        headers = dict(self._headers)
        offered = [token.strip() for token in headers.get(b"connection", b"").lower().split(b",")]
        return b"upgrade" in offered and headers.get(b"upgrade", b"").lower() == b"websocket"

    def _hand_over(self) -> None:
        """Give the connection to a WebSocket, unless it has ended meanwhile."""
        self.turnstile.leave()
        if self.transport.is_closing():
            return
        self._drain.stop()
        self._inlet.end()
        self._end_rest()
        self._held = False
        self.read_on()
        self._server.connections.discard(self)
        socket = self.websocket(self._config, self._server)
        self.transport.set_protocol(socket)
        socket.connection_made(self.transport)
        socket.open(self._opened, self._head_again())
        del self._parser  # and with it a circle

    # what the parser finds; what is raised here comes out of `feed_data`

    def on_message_begin(self) -> None:
        """Begin a request."""
        self._url, self._headers, self._expects_continue = b"", [], False
        self._receiving = True
        self._in_body = False

    def on_url(self, url: bytes) -> None:
        """Take a part of the target."""
        self._url += url

    def on_header(self, name: bytes, value: bytes) -> None:
        """Take a header; one that comes behind a chunked body is none (RFC 9110 6.5.1)."""
        if self._in_body:
            return
        if len(self._headers) >= self.limits.head_lines:
            raise Refused(431, f"The request has more than {self.limits.head_lines} header lines.")
        name = name.lower()
        if name == b"expect" and value.lower() == b"100-continue":
            self._expects_continue = True
        self._headers.append((name, value))

    def on_headers_complete(self) -> None:
        """Begin what has its turn."""
        self._quiet_bytes = 0
        self._require_good_head()
        self._in_body = not self._parser.should_upgrade()
        if self._in_body:
            self._queue(self._scope("http") | {"method": self._parser.get_method().decode("ascii")})
            self.read_on()
        elif self._opens_websocket():
            self._opened = self._scope("websocket")

    def on_body(self, body: bytes) -> None:
        """Take a part of a body."""
        self._quiet_bytes = 0
        if self._coming is not None and self._in_body:
            self._coming.take(body, more=True)
            self.read_on()

    def on_message_complete(self) -> None:
        """The request has come as a whole."""
        self._quiet_bytes = 0
        self._end_receiving()
        if self._coming is not None and self._in_body:
            self._coming.take(b"", more=False)
            self.read_on()

    def _scope(self, kind: str) -> dict[str, Any]:
        """Describe the request whose head has come, as ASGI has it."""
        url = httptools.parse_url(self._url)
        path, root = url.path.decode("ascii"), self._config.root_path
        return {
            **self._place,
            "type": kind,
            "scheme": self._schemes[kind],
            "http_version": self._parser.get_http_version(),
            "path": root + (unquote(path) if "%" in path else path),
            "raw_path": root.encode("ascii") + url.path,
            "query_string": url.query or b"",
            "headers": self._headers,
            "state": {},
        }

    def _require_good_head(self) -> None:
        if self._parser.get_http_version() not in _VERSIONS:
            raise Refused(400, NOT_HTTP)
        method = self._parser.get_method().decode("ascii")
        path = self._url.partition(b"?")[0].decode("latin-1")
        asked = method, unquote(path) if "%" in path else path
        self._is_stop, self._is_life_sign = is_stop(*asked), is_life_sign(*asked)
        self._is_urgent = self._is_life_sign or is_heartbeat(*asked)
        self._require_room()
        if method == "CONNECT":  # the parser would wait for another protocol for ever
            raise Refused(400, "CONNECT is for proxies, and the gateway is none.")
        if not path.startswith("/"):
            raise Refused(400, "The target of the request is not a path of this gateway, such as /bodies.")
        hosts = [name for name, _ in self._headers].count(b"host")
        if hosts > 1 or (hosts == 0 and self._parser.get_http_version() != "1.0"):
            raise Refused(400, f"The request has {hosts or 'no'} Host headers; it takes one.")
        if self._parser.should_upgrade() and self._opens_websocket():
            self._require_good_handshake(method)

    def _require_room(self) -> None:
        if self._admitted is Admitted.STOPS and not (self._is_stop or self._is_life_sign):
            raise Refused(503, FULL)
        most = self.limits.requests_ahead
        if len(self._under_way) >= (2 * most if self._is_stop else most):
            raise Refused(503, f"More than {most} requests were sent ahead of an answer.")

    def _require_good_handshake(self, method: str) -> None:
        """Refuse a WebSocket that cannot be opened (RFC 6455 4.2.1)."""
        headers = dict(self._headers)
        if self._under_way:
            raise Refused(400, "A WebSocket was asked for ahead of the answer to another request.")
        if method != "GET" or self._parser.get_http_version() != "1.1":
            raise Refused(400, "A WebSocket is opened by GET with HTTP/1.1.")
        if headers.get(b"sec-websocket-version") != b"13":
            raise Refused(400, "A WebSocket is opened with the header Sec-WebSocket-Version: 13.")
        if not _KEY.fullmatch(headers.get(b"sec-websocket-key", b"")):
            raise Refused(400, "A WebSocket is opened with a Sec-WebSocket-Key of 16 bytes in base64.")

    # requests under way

    def _queue(self, scope: dict[str, Any]) -> None:
        self._coming = request = PendingRequest(
            self,
            self._config.loaded_app,
            scope,
            keep_alive=scope["http_version"] != "1.0" and self._parser.should_keep_alive(),
            continues=self._expects_continue,
            is_stop=self._is_stop,
            is_urgent=self._is_urgent,
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
            self._drain.watch()
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
            self._rest = asyncio.get_running_loop().call_later(
                self._config.timeout_keep_alive, self.transport.close
            )
            self._restart_deadline()
            self.connection_limit.rest(self)

    # requests that are refused, or do not come

    def _start_deadline(self) -> None:
        if self._deadline is None:
            self._deadline = asyncio.get_running_loop().call_later(self.limits.receive_s, self._too_slow)

    def _restart_deadline(self) -> None:
        """What came behind a request that was being answered had no time of its own yet."""
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None
            self._start_deadline()

    def _end_receiving(self) -> None:
        self._receiving = False
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    def _too_slow(self) -> None:
        self._deadline = None
        if self.transport.is_closing():
            return
        last = self._under_way[-1] if self._under_way else None
        if last is None or (len(self._under_way) == 1 and self._in_body and last.undone):
            self._refuse(Refused(408, f"The request did not come as a whole in {self.limits.receive_s:g} s."))
        else:
            self._start_deadline()

    def _refuse(self, refused: Refused) -> None:
        """End the connection with an answer; before it comes what was begun, and nothing that was not."""
        path = quote(self._url.partition(b"?")[0][:_INSTANCE_BYTES], safe="/%")
        answer = refused.answer(self.default_headers, path, self._headers)
        self._refusal = b"" if self._in_body and not self._take_back() else answer
        self._end_receiving()
        self._inlet.pass_over()
        self._held = True
        self.read_on()
        begun = len(list(takewhile(lambda request: request.started, self._under_way)))
        while len(self._under_way) > begun:
            self._under_way.pop().give_up()
        if not self._under_way:
            self._send_refusal()

    def _take_back(self) -> bool:
        """Give up the request whose body is coming, if nothing was done yet because of it."""
        last = self._under_way[-1] if self._under_way else None
        if last is None or not last.undone or last.answering:
            return False
        self._under_way.pop()
        last.give_up()
        return True

    def _send_refusal(self) -> None:
        """Answer, and close a moment later: a client that still sends then may lose the answer."""
        self.transport.write(self._refusal or b"")
        if self.transport.can_write_eof():  # not over TLS
            self.transport.write_eof()
        self._held, self._coming = False, None
        self.read_on()
        asyncio.get_running_loop().call_later(LINGER_S, self._close)

    def _close(self) -> None:
        self.transport.close()
        self._drain.watch()


def _address(found: Any) -> tuple[str, int] | None:
    """Host and port of a socket's end; None where it has none."""
    return (str(found[0]), int(found[1])) if isinstance(found, tuple) else None
