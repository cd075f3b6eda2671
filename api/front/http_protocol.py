"""HTTP as uvicorn speaks it, with bounds: no client makes the event loop work, or a stop wait, for long.

What is asked for behind a request that is not answered yet waits for its turn, and is not begun once its
client has left. Stops do not wait: they are begun as soon as their head has come, and only their answers keep
the order.
"""

import asyncio
import re
from collections import deque
from functools import partial
from itertools import takewhile
from typing import Any, ClassVar, Final
from urllib.parse import quote, unquote

import httptools
from uvicorn.protocols.http.flow_control import HIGH_WATER_LIMIT, FlowControl
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle

from api.front import certificates
from api.front.connections import Admitted, ConnectionLimit
from api.front.drain import Drain
from api.front.intake import Inlet, Intake
from api.front.limits import LINGER_S, Limits
from api.front.pending_requests import PendingRequest
from api.front.refusals import NOT_HTTP, Refused, refusal_in
from api.front.stop_paths import is_heartbeat, is_life_sign, is_stop
from api.front.turnstile import Turnstile

_VERSIONS = ("1.1", "1.0")
_KEY = re.compile(rb"[A-Za-z0-9+/]{22}==")
_INSTANCE_BYTES = 200
FULL: Final = "All connections of the gateway are in use, and only stops and /livez are served beyond them."


class _Flow(FlowControl):
    """Reading also pauses while something that was read has not been parsed."""

    def __init__(self, transport: asyncio.Transport) -> None:
        super().__init__(transport)
        self.behind = False

    def resume_reading(self) -> None:
        """Read on, unless there is enough to parse."""
        if self.read_paused and not self.behind:
            super().resume_reading()


class HttpProtocol(HttpToolsProtocol):
    """A connection."""

    limits: ClassVar[Limits] = Limits()
    connection_limit: ClassVar[ConnectionLimit]
    turnstile: ClassVar[Turnstile]
    intake: ClassVar[Intake]

    flow: _Flow

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._drain: Drain
        self._admitted = Admitted.EVERYTHING
        self._under_way: deque[PendingRequest] = deque()
        """Requests that are not answered yet, in their order; the first has its turn."""
        self.url = b""
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
        self._deadline: asyncio.TimerHandle | None = None
        self._certified: str | None = None

    # the connection

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # as uvicorn does
        """Decide what may be asked for."""
        super().connection_made(transport)
        self.flow = _Flow(transport)
        self._certified = certificates.common_name(transport)
        self._drain = Drain(transport, self.limits.stall_s)
        self._admitted = self.connection_limit.admit(self, len(self.connections))
        if self._admitted is Admitted.NOTHING:
            transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Begin nothing more that was asked for here."""
        self._inlet.end()
        self._give_up_all()
        self._end_receiving()
        self.connection_limit.leave(self)
        self._drain.stop()
        super().connection_lost(exc)
        self._under_way.clear()
        del self.cycle  # and with it a circle, as with those that never began

    def eof_received(self) -> None:
        """Do as if the client had left altogether: uvicorn closes the connection."""
        self._give_up_all()

    def give_way(self) -> None:
        """End at once: others need the place."""
        self.connections.discard(self)
        self.transport.abort()

    def shutdown(self) -> None:
        """Answer what was begun, and nothing behind it."""
        super().shutdown()
        if self._under_way:
            self._under_way[0].cycle.keep_alive = False

    def pause_writing(self) -> None:
        """The client does not take its answer as fast as it comes."""
        super().pause_writing()
        self._drain.watch()

    def resume_writing(self) -> None:
        """It has taken most of it."""
        super().resume_writing()
        self._drain.stop()

    def _give_up_all(self) -> None:
        for request in self._under_way:
            request.give_up()

    # what comes in

    def data_received(self, data: bytes) -> None:
        """Parse it in pieces that are soon parsed; others have their turn in between."""
        if self._refusal is None:
            self._unset_keepalive_if_required()
            self.connection_limit.ask(self)
        self._inlet.take(data)

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
            self.parser.feed_data(piece)
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
        if held:
            self.flow.behind = True
            self.flow.pause_reading()
        elif self._refusal is None:
            self._read_on()

    def _read_on(self) -> None:
        self.flow.behind = bool(self._inlet.unread)
        if not (self._in_body and self._has_enough_to_read()):
            self.flow.resume_reading()

    def _has_enough_to_read(self) -> bool:
        """Whether the application has not read the body so far; it reads no more once it has answered."""
        cycle = self.cycle
        return cycle.more_body and not cycle.response_complete and len(cycle.body) > HIGH_WATER_LIMIT

    def _upgrade(self, rest: bytes) -> None:
        """Hand a WebSocket over; read what offers another protocol as if it did not (RFC 9110 7.8)."""
        if self._should_upgrade():
            self._end_receiving()
            self._inlet.pass_over()
            self.connection_limit.leave(self)
            self.turnstile.enter(self._hand_over)
            return
        # The parser takes no body of a request that offers a protocol, though it may have one.
        version = self.parser.get_http_version().encode()
        lines = [b"%b: %b" % header for header in self.headers if header[0] != b"upgrade"]
        head = [self.parser.get_method() + b" " + self.url + b" HTTP/" + version, *lines, b"", b""]
        self._inlet.put_back(b"\r\n".join(head) + rest)
        self._quiet_bytes = 0
        self.parser = httptools.HttpRequestParser(self)
        self.parser.set_dangerous_leniencies(lenient_data_after_close=True)
        self._parse_on()

    def _hand_over(self) -> None:
        """Give the connection to a WebSocket, unless it has ended meanwhile."""
        self.turnstile.leave()
        if self.transport.is_closing():
            return
        self._drain.stop()
        self._inlet.end()
        self.flow.behind = False
        self.flow.resume_reading()
        self.handle_websocket_upgrade()
        del self.parser  # and with it a circle

    # what the parser finds; what is raised here comes out of `feed_data`

    def on_message_begin(self) -> None:
        """Begin a request."""
        super().on_message_begin()
        certificates.note(self.scope, self._certified)
        self._receiving = True
        self._in_body = False

    def on_header(self, name: bytes, value: bytes) -> None:
        """Take a header; one that comes behind a chunked body is none (RFC 9110 6.5.1)."""
        if self._in_body:
            return
        if len(self.headers) >= self.limits.head_lines:
            raise Refused(431, f"The request has more than {self.limits.head_lines} header lines.")
        super().on_header(name, value)

    def on_headers_complete(self) -> None:
        """Begin what has its turn."""
        self._quiet_bytes = 0
        self._require_good_head()
        upgrade = self.parser.should_upgrade()
        if upgrade and not self._should_upgrade():
            return
        self._in_body = not upgrade
        super().on_headers_complete()
        if self.pipeline:
            self._queue(*self.pipeline.pop())
            self._read_on()

    def on_body(self, body: bytes) -> None:
        """Take a part of a body."""
        self._quiet_bytes = 0
        super().on_body(body)

    def on_message_complete(self) -> None:
        """The request has come as a whole."""
        self._quiet_bytes = 0
        self._end_receiving()
        if not self.parser.should_upgrade():
            super().on_message_complete()
            self._read_on()

    def _require_good_head(self) -> None:
        if self.parser.get_http_version() not in _VERSIONS:
            raise Refused(400, NOT_HTTP)
        method = self.parser.get_method().decode("ascii")
        path = self.url.partition(b"?")[0].decode("latin-1")
        asked = method, unquote(path) if "%" in path else path
        self._is_stop, self._is_life_sign = is_stop(*asked), is_life_sign(*asked)
        self._is_urgent = self._is_life_sign or is_heartbeat(*asked)
        self._require_room()
        if method == "CONNECT":  # the parser would wait for another protocol for ever
            raise Refused(400, "CONNECT is for proxies, and the gateway is none.")
        if not path.startswith("/"):
            raise Refused(400, "The target of the request is not a path of this gateway, such as /bodies.")
        hosts = [name for name, _ in self.headers].count(b"host")
        if hosts > 1 or (hosts == 0 and self.parser.get_http_version() != "1.0"):
            raise Refused(400, f"The request has {hosts or 'no'} Host headers; it takes one.")
        if self.parser.should_upgrade() and self._should_upgrade():
            self._require_good_handshake(method)

    def _require_room(self) -> None:
        if self._admitted is Admitted.STOPS and not (self._is_stop or self._is_life_sign):
            raise Refused(503, FULL)
        most = self.limits.requests_ahead
        if len(self._under_way) >= (2 * most if self._is_stop else most):
            raise Refused(503, f"More than {most} requests were sent ahead of an answer.")

    def _require_good_handshake(self, method: str) -> None:
        """Refuse a WebSocket that cannot be opened (RFC 6455 4.2.1)."""
        headers = dict(self.headers)
        if self._under_way:
            raise Refused(400, "A WebSocket was asked for ahead of the answer to another request.")
        if method != "GET" or self.parser.get_http_version() != "1.1":
            raise Refused(400, "A WebSocket is opened by GET with HTTP/1.1.")
        if headers.get(b"sec-websocket-version") != b"13":
            raise Refused(400, "A WebSocket is opened with the header Sec-WebSocket-Version: 13.")
        if not _KEY.fullmatch(headers.get(b"sec-websocket-key", b"")):
            raise Refused(400, "A WebSocket is opened with a Sec-WebSocket-Key of 16 bytes in base64.")

    # requests under way

    def _start_asgi_task(self, cycle: RequestResponseCycle, app: Any) -> None:
        """Uvicorn says so of a request with none before it."""
        self._queue(cycle, app)

    def _queue(self, cycle: RequestResponseCycle, app: Any) -> None:
        request = PendingRequest(app, cycle, is_stop=self._is_stop, is_urgent=self._is_urgent)
        self._under_way.append(request)
        if self._admitted is Admitted.STOPS:
            cycle.keep_alive = False
            if request.is_stop:
                self.connection_limit.stop(self)
        if request is self._under_way[0]:
            request.give_turn()
        if request.is_stop or request.has_turn:
            self._begin(request)

    def _begin(self, request: PendingRequest) -> None:
        """Begin what has its turn: what is urgent at once, the rest as the turnstile lets it."""
        request.started = True
        begin = partial(super()._start_asgi_task, request.cycle, request)  # type: ignore[arg-type]  # an ASGI application
        if request.is_stop:
            request.on_end = self.turnstile.end_stop
            self.turnstile.begin_stop()
            begin()
        elif request.is_urgent:
            begin()
        else:
            request.on_end = self.turnstile.leave
            self.turnstile.enter(begin)

    def on_response_complete(self) -> None:
        """Let the next request have its turn."""
        answered = self._under_way.popleft()
        if self.transport.is_closing():
            self._drain.watch()
        elif answered.leaves_unread:
            self._refusal = b""
            self._inlet.pass_over()
            self._end_receiving()
            self._send_refusal()
        elif self._under_way:
            self.server_state.total_requests += 1
            self._restart_deadline()
            self._read_on()
            first = self._under_way[0]
            first.give_turn()
            if not first.started:
                self._begin(first)
        elif self._refusal is not None:
            self._send_refusal()
        else:
            super().on_response_complete()
            self._restart_deadline()
            self.connection_limit.rest(self)

    # requests that are refused, or do not come

    def _start_deadline(self) -> None:
        if self._deadline is None:
            self._deadline = self.loop.call_later(self.limits.receive_s, self._too_slow)

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
        path = quote(self.url.partition(b"?")[0][:_INSTANCE_BYTES], safe="/%")
        answer = refused.answer(self.server_state.default_headers, path, self.headers or ())
        self._refusal = b"" if self._in_body and not self._take_back() else answer
        self._end_receiving()
        self._inlet.pass_over()
        self.flow.behind = True
        self.flow.pause_reading()
        begun = len(list(takewhile(lambda request: request.started, self._under_way)))
        while len(self._under_way) > begun:
            self._under_way.pop().give_up()
        if not self._under_way:
            self._send_refusal()

    def _take_back(self) -> bool:
        """Give up the request whose body is coming, if nothing was done yet because of it."""
        last = self._under_way[-1] if self._under_way else None
        if last is None or not last.undone or last.cycle.response_started:
            return False
        self._under_way.pop()
        last.give_up()
        return True

    def _send_refusal(self) -> None:
        """Answer, and close a moment later: a client that still sends then may lose the answer."""
        self.transport.write(self._refusal or b"")
        if self.transport.can_write_eof():  # not over TLS
            self.transport.write_eof()
        self.flow.behind = False
        self.flow.resume_reading()
        self.loop.call_later(LINGER_S, self._close)

    def _close(self) -> None:
        self.transport.close()
        self._drain.watch()
