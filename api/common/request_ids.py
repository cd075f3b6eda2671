"""The id of each request: its sender's, or a new one; it is answered, and what is done for it carries it."""

import re
from collections.abc import Awaitable, Iterable
from time import perf_counter
from typing import Final

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gateway.door.caller import ORIGIN, Origin, new_request_id
from gateway.door.traffic import Client, Traffic

HEADER: Final = "X-Request-Id"
_NAME: Final = b"x-request-id"
_TRACE_NAME: Final = b"traceparent"
_GOOD: Final = re.compile(rb"[!-~]{1,128}")
_TRACE: Final = re.compile(
    rb"(?!ff|00.{53}.)[0-9a-f]{2}-(?!0{32})([0-9a-f]{32})-(?!0{16})[0-9a-f]{16}-[0-9a-f]{2}(?:-.*)?"
)
_START: Final = "http.response.start"
_STARTS: Final = frozenset({_START, "websocket.accept", "websocket.http.response.start"})

_CACHE_CONTROL: Final = b"cache-control"
_NO_STORE: Final = (_CACHE_CONTROL, b"no-store")
"""The header of answers that no cache may keep, such as the position of a motor."""
_HAS_BEGUN: Final = "motion-gateway.answer-has-begun"

Headers = Iterable[tuple[bytes, bytes]]


def request_id_of(headers: Headers) -> str:
    """Take the id from `X-Request-Id`, or the trace's from `traceparent` (W3C Trace Context), or make one.

    An id is 1 to 128 printable ASCII characters without blanks; another one is passed over.
    """
    trace: re.Match[bytes] | None = None
    for name, value in headers:
        if name == _NAME and _GOOD.fullmatch(value):
            return value.decode("ascii")
        if name == _TRACE_NAME:
            trace = _TRACE.fullmatch(value)
    return trace[1].decode("ascii") if trace else new_request_id()


def header_of(request_id: str) -> tuple[bytes, bytes]:
    """Give the header of the answer."""
    return _NAME, request_id.encode("ascii")


def has_begun(scope: Scope) -> bool:
    """Tell if the head of the answer to a request has gone."""
    return _HAS_BEGUN in scope


def _says_how_long(headers: Headers) -> bool:
    """Tell if an answer says itself how long it may be kept."""
    for name, _ in headers:  # noqa: SIM110  # at each request: `any` would make a generator
        if name == _CACHE_CONTROL:
            return True
    return False


class RequestIds:
    """Gives every request and every WebSocket its id, and lets what is done for it be done in its name."""

    def __init__(self, app: ASGIApp, traffic: Traffic | None = None) -> None:
        self._app, self._traffic = app, traffic or Traffic()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, and add the id, and that no cache keeps it, to the head of its answer."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        request_id = request_id_of(scope["headers"])
        began_at, traffic = perf_counter(), self._traffic

        def answer(message: Message) -> Awaitable[None]:
            if message["type"] in _STARTS:
                scope[_HAS_BEGUN] = True
                headers = message["headers"] = [*message.get("headers", ()), header_of(request_id)]
                if not _says_how_long(headers):
                    headers.append(_NO_STORE)
                if message["type"] == _START:
                    traffic.note(scope["method"], message["status"], perf_counter() - began_at)
            return send(message)

        client = scope.get("client")
        caller = f"{scope['type']} {client[0]}" if client else scope["type"]
        kind = _kind_of(scope)
        traffic.clients[kind] += 1
        before = ORIGIN.set(Origin(caller, request_id, address=client[0] if client else ""))
        try:
            await self._app(scope, receive, answer)
        finally:
            ORIGIN.reset(before)
            traffic.clients[kind] -= 1


def _kind_of(scope: Scope) -> Client:
    """The kind of client that a request comes from."""
    if scope["type"] == "websocket":
        return "websocket"
    return "sse" if scope["path"].endswith("/events/stream") else "request"
