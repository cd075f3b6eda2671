"""Request bodies: JSON of which nothing is guessed, rounded, overwritten or silently dropped."""

import json
from collections.abc import Callable, Collection
from functools import cached_property, partial
from typing import Any, ClassVar, Final

from fastapi import HTTPException, Request
from pydantic import ValidationError
from starlette.requests import HTTPConnection
from starlette.types import Receive, Scope, Send

from api.common.calling import NOTHING, Call
from api.common.faults import InvalidBody
from api.common.idempotency import READS, WITH_EFFECT, require_no_key
from api.common.routes import HttpRoute
from gateway.door.calls import aside
from gateway.door.problems import InvalidRequest
from gateway.door.strict_json import INLINE_BYTES, NoContent, NotStrict, read
from gateway.door.table import Right
from protocols.wording import shown, unknown

JSON: Final = "application/json"
MAX_BODY_BYTES = 65_536
"""A longer request body is refused with 413."""


def _header(request: Request, wanted: bytes) -> bytes:
    """The first header of a name, empty where there is none; starlette's own search decodes all of them."""
    for name, value in request.scope["headers"]:
        if name == wanted:
            return bytes(value)
    return b""


async def read_body(request: Request, most: int) -> bytes:
    """Read the bytes of a request's body.

    :raises HTTPException: 413 as soon as they are over `most`, 400 where the client leaves in the middle.
    """
    length = int(_header(request, b"content-length") or 0)
    received = bytearray()
    more = True
    while more and max(length, len(received)) <= most:
        message = await request.receive()
        if message["type"] == "http.disconnect":
            raise HTTPException(400, "The request ended in its middle; nothing was sent.")
        received += message.get("body", b"")
        more = message.get("more_body", False)
    if max(length, len(received)) > most:
        raise HTTPException(413, f"The request body is over {most} bytes; nothing was sent.")
    return bytes(received)


def _where(error: ValueError) -> str:
    if isinstance(error, json.JSONDecodeError):
        return f"it cannot be read at line {error.lineno}, column {error.colno}"
    return "it is not UTF-8 text"


class StrictRequest(Request):
    """A request whose body is short and read by `parse`."""

    most: ClassVar[int] = MAX_BODY_BYTES

    async def body(self) -> bytes:
        """Read the body's bytes; errors as of `read_body`."""
        if not hasattr(self, "_content"):
            self._content = await read_body(self, self.most)
        return self._content

    async def json(self) -> Any:
        """Read the body.

        :raises HTTPException: 400 where it is no JSON, 422 where it is not strict.
        """
        try:
            return await read(await self.body())
        except NotStrict as error:
            raise HTTPException(422, f"The request is not valid: {error}; nothing was sent.") from None
        except ValueError as error:
            raise HTTPException(
                400, f"The request body is not JSON: {_where(error)}; nothing was sent."
            ) from None


class StrictRoute(HttpRoute):
    """A route that knows every part of its query, and takes its body as strict JSON or not at all.

    A software stop goes out whatever stands in its query and in its headers.
    """

    refuses_keys: ClassVar[bool] = True
    """True if it refuses an Idempotency-Key before its body is read."""
    request_class: ClassVar[type[StrictRequest]] = StrictRequest

    def __init__(self, path: str, endpoint: Callable[..., Any], **options: Any) -> None:
        super().__init__(path, endpoint, **options)
        effect = not WITH_EFFECT.isdisjoint(self.methods or ())
        self._stops = self.right is Right.STOP
        self._heeds_keys = effect and not self._stops
        self._refuses_keys = self.refuses_keys and self._heeds_keys and self.right not in READS

    @cached_property
    def call(self) -> Call:
        """Its endpoint, with what that takes."""
        return Call(self.endpoint, self.path)

    @cached_property
    def _takes_nothing(self) -> bool:
        """True if a body would be passed over; CSV and programs are read by routes that describe them."""
        reads_itself = not self.in_document or "requestBody" in self.own_entry
        return self._heeds_keys and self.call.body is None and not reads_itself

    async def answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Call the endpoint with what it takes, and send its response."""
        request = await self._checked(scope, receive)
        body = b"" if self.call.body is None else await request.body()
        content = await request.json() if body else NOTHING
        read = partial(self.call.read, request, scope["path_params"], content)
        values = read() if len(body) <= INLINE_BYTES else await aside(read)
        response = await self.endpoint(**values)
        await response(scope, receive, send)

    async def _checked(self, scope: Scope, receive: Receive) -> StrictRequest:
        """Refuse what is not strict; give the request with its body read."""
        request = self.request_class(scope, receive)
        if not self._stops and scope["query_string"]:
            require_known(request, self.call.query)
        if self._refuses_keys:
            require_no_key(request)
        if self._takes_nothing and _has_body(request):
            await _require_nothing(request)
        if self.call.body is not None and await request.body() and not self._stops:
            require_type(request, JSON)
        return request


def _has_body(request: Request) -> bool:
    headers = request.headers
    return headers.get("content-length", "0") != "0" or "transfer-encoding" in headers


async def _require_nothing(request: Request) -> None:
    """Refuse what a body asks for at a route that would pass it over.

    :raises InvalidBody: it names something.
    :raises HTTPException: as of `StrictRequest.json`, or it is not JSON.
    """
    strict = StrictRequest(request.scope, request.receive)
    if not await strict.body():
        return
    require_type(strict, JSON)
    content = await strict.json()
    try:
        NoContent.model_validate(content)
    except ValidationError as error:
        raise InvalidBody(error, content, NoContent) from None


def require_type(request: Request, *wanted: str) -> str:
    """Give the media type of a request's body.

    :raises HTTPException: 415 where it is none of those wanted.
    """
    content_type = _header(request, b"content-type").decode("latin-1")
    kind = content_type.partition(";")[0].strip().lower()
    if kind not in wanted:
        said = f"The request body is {content_type or 'of no type'}, not {' or '.join(wanted)}"
        raise HTTPException(415, f"{said}; nothing was sent.")
    return kind


def require_known(request: HTTPConnection, known: Collection[str]) -> None:
    """Refuse a query with other parameters than the route has.

    :raises InvalidRequest: one has another name; the error says which there are.
    """
    if not request.scope["query_string"]:
        return
    for name in request.query_params:
        if name not in known:
            raise InvalidRequest(
                f"There is no query parameter {shown(name)} here ({unknown(name, known)}); nothing was sent.",
                "See /docs for what can be asked.",
            )
