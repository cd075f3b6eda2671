"""Requests with an Idempotency-Key: carried out once, however often they are sent, over restarts, too."""

import asyncio
import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from hashlib import sha256
from http import HTTPStatus
from typing import Final

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from api.common.access import Access
from api.common.calling import read_body
from api.common.idempotency import HEADER, HONOURED, LONGEST_KEY, WITH_EFFECT, has_key, takes_key
from api.common.problems import plain_problem, response_to
from api.common.responses import render
from api.walker import Walker
from gateway.door.caller import acting, current
from gateway.door.calls import aside
from gateway.door.keys import KeptAnswer, Keys, LeftOpen, RequestKey
from gateway.door.problems import GatewayError, InvalidRequest, problem_of
from gateway.door.strict_json import INLINE_BYTES, parse
from gateway.door.table import Right

REPLAYED: Final = "Idempotency-Replayed"
WITHIN: Final = "start_within_s"
MOST_BYTES: Final = 262_144
"""No route takes a longer body."""


@dataclass(eq=False)
class _Answer:
    """The answer to a request, which can be given again."""

    status: int = 0
    headers: list[tuple[str, str]] = field(default_factory=list)
    body: bytes = b""

    def note(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            self.status = message["status"]
            headers = message["headers"]
            self.headers = [(name.decode("latin-1"), value.decode("latin-1")) for name, value in headers]
        elif message["type"] == "http.response.body":
            self.body += message.get("body", b"")

    @property
    def location(self) -> str | None:
        return dict(self.headers).get("location")

    def text(self) -> str:
        return json.dumps({"headers": self.headers, "body": self.body.decode("utf-8", "surrogateescape")})

    @classmethod
    def read(cls, kept: KeptAnswer) -> "_Answer":
        told = json.loads(kept.text)
        headers = [(name, value) for name, value in told["headers"]]
        return cls(kept.status, headers, told["body"].encode("utf-8", "surrogateescape"))

    @classmethod
    def of(cls, response: Response) -> "_Answer":
        return cls(response.status_code, list(response.headers.items()), bytes(response.body))

    def response(self, *more: tuple[str, str]) -> Response:
        response = Response(self.body, self.status)
        headers = [*self.headers, *more]
        response.raw_headers = [(name.encode("latin-1"), value.encode("latin-1")) for name, value in headers]
        return response

    def again(self) -> Response:
        return self.response((REPLAYED.lower(), "true"))

    @property
    def is_refusal(self) -> bool:
        return HTTPStatus.BAD_REQUEST <= self.status != HTTPStatus.INTERNAL_SERVER_ERROR


@dataclass(eq=False)
class _First:
    """The first request with a key, while it is under way."""

    key: RequestKey
    over: asyncio.Event = field(default_factory=asyncio.Event)
    answer: _Answer | None = None
    """The answer; None if the request was refused and nothing was sent: then the next one is the first."""


class IdempotentRequests:
    """Looks at the keys of requests with an effect; never of stops, for to stop twice does no harm."""

    def __init__(self, keys: Keys, access: Access, rows: Walker, app: ASGIApp) -> None:
        self._app, self._keys, self._access, self._rows = app, keys, access, rows
        self._under_way: dict[str, _First] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Carry the request out, or give the answer that it had before."""
        given = _key_of(scope)
        caller = self._access.caller_of(scope)
        row = self._rows.find(scope)
        if caller is None or row is None or not row.is_open_to(scope):
            await self._app(scope, receive, send)  # it refuses before it reads the body
            return
        request = Request(scope, receive)
        try:
            _require_good(given)
            body = await read_body(request, MOST_BYTES)
            where = f"{caller} {request.method} {self._keys.place_of(scope['path'])}"
            key = RequestKey(where, given, await _digest(request, body))
            before = await self._before(key, body, request, send)
        except GatewayError as error:
            before = response_to(problem_of(error, scope["path"]))
        except HTTPException as error:
            before = response_to(plain_problem(error.status_code, error.detail, scope["path"]))
        if before is not None:
            await before(scope, receive, send)

    async def _before(self, key: RequestKey, body: bytes, request: Request, send: Send) -> Response | None:
        """The answer to an earlier request, or to the first, if that is refused: its key is free by then.

        None where it has its answer now.
        """
        while (first := self._under_way.get(key.name)) is not None:
            first.key.require_same(key.digest)
            await first.over.wait()
            if first.answer is not None:
                return first.answer.again()
        self._under_way[key.name] = first = _First(key)
        try:
            known = await self._keys.known(key)
            if known is None:
                answer = await self._carry_out(key, body, request, send)
                kept = await self._keys.end(key, answer.status, answer.location, answer.text())
                first.answer = answer if kept else None
                return answer.response() if answer.is_refusal else None
            first.answer = _Answer.read(known) if isinstance(known, KeptAnswer) else _found(known, request)
            return first.answer.again()
        finally:
            del self._under_way[key.name]
            first.over.set()

    async def _carry_out(self, key: RequestKey, body: bytes, request: Request, send: Send) -> _Answer:
        """Let it be done, and give its answer, which is sent at once if it is no refusal."""
        self._keys.begin(key)
        answer = _Answer()

        async def note(message: Message) -> None:
            answer.note(message)
            if not answer.is_refusal:
                await send(message)

        with acting(replace(current(), key=key.name)):
            request.scope[HONOURED] = True
            await self._app(request.scope, _once_more(body), note)
        return answer


def relies_on_key(scope: Scope, right_of: Callable[[Scope], Right | None]) -> bool:
    """Tell if a request changes something, stops nothing, and has a key; its route tells the right."""
    if scope["type"] != "http" or scope["method"] not in WITH_EFFECT or not has_key(scope):
        return False
    return takes_key(scope["method"], scope["path"], right_of(scope))


def _key_of(scope: Scope) -> str:
    return b",".join(value for name, value in scope["headers"] if name == HEADER).decode("latin-1")


def _require_good(key: str) -> None:
    if not 0 < len(key) <= LONGEST_KEY or not all("!" <= char <= "~" for char in key):
        raise InvalidRequest(
            f"The header Idempotency-Key is not of 1 to {LONGEST_KEY} visible ASCII characters; nothing was "
            "sent.",
            "Give each request a key of its own, such as a UUID.",
        )


async def _digest(request: Request, body: bytes) -> str:
    """A digest of all that makes it this request; how long its client waits for the end is no part of it."""
    asked = [part for part in request.scope["query_string"].split(b"&") if not part.startswith(b"wait=")]
    canonical = _canonical(body) if len(body) <= INLINE_BYTES else await aside(_canonical, body)
    return sha256(b"\0".join([b"&".join(asked), canonical])).hexdigest()


def _canonical(body: bytes) -> bytes:
    """Blanks, the order of members and the point of a whole number make no other request.

    Nor does how long it may wait for its turn: of a repetition, less of that is left.
    """
    try:
        content = parse(body)
    except ValueError:
        return body
    if isinstance(content, dict):
        content.pop(WITHIN, None)
    return json.dumps(content, sort_keys=True).encode()


def _found(left: LeftOpen, request: Request) -> _Answer:
    """Answer for an earlier life, which has ended before it could."""
    if left.moves:
        return _Answer.of(render(request, left.begun()))
    return _Answer.of(response_to(problem_of(left.unknown(), request.scope["path"])))


def _once_more(body: bytes) -> Receive:
    """Let a body be read that was read already."""

    async def receive() -> Message:
        return {"type": "http.request", "body": body, "more_body": False}

    return receive
