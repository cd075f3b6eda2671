"""The parts of a request that an operation takes: found once, by its row, and read strictly each time."""

import json
from collections.abc import Callable, Collection, Mapping
from functools import cached_property, partial
from inspect import Parameter
from typing import Any, Final, Literal

from pydantic import TypeAdapter, ValidationError
from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection, Request

from api.common.faults import InvalidParts
from api.common.idempotency import READS, WITH_EFFECT, require_no_key
from gateway.door.calls import aside
from gateway.door.names import NAMES
from gateway.door.problems import InvalidRequest
from gateway.door.strict_json import INLINE_BYTES, NoContent, NotStrict, read
from gateway.door.table import Operation, Right, adapter_of
from protocols.wording import shown, unknown

JSON: Final = "application/json"
TEXT: Final = "text/plain"
MAX_BODY_BYTES: Final = 65_536
"""A longer request body is refused with 413, unless its row allows one."""
NOTHING: Final = object()
"""Stands for what a request does not have."""
Place = Literal["path", "query", "body"]


class CallPart:
    """A parameter of an operation: where a request has it, and of which type it is."""

    def __init__(
        self, name: str, place: Place, annotation: Any, default: Callable[[], object] | None = None
    ) -> None:
        self.name, self.annotation = name, annotation
        self._at = (place,) if place == "body" else (place, name)
        self._default = default
        """Makes what stands for it where it is left out; None: it may not be."""
        self._is_text = annotation is str
        """True if every text is good for it."""

    @cached_property
    def adapter(self) -> TypeAdapter[Any]:
        """Its type, ready to be used."""
        return adapter_of(self.annotation)

    def read(self, given: object, errors: list[Any]) -> object:
        """Read what a request has; what is wrong with it comes to the errors."""
        if given is NOTHING:
            return self._left_out(errors)
        if self._is_text:
            return given
        try:
            return self.adapter.validate_python(given)
        except ValidationError as error:
            found = error.errors(include_url=False)
            errors += [{**fault, "loc": (*self._at, *fault["loc"])} for fault in found]
            return None

    def _left_out(self, errors: list[Any]) -> object:
        if self._default is not None:
            return self._default()
        errors.append({"type": "missing", "loc": self._at, "msg": "Field required", "input": None})
        return None


class Call:
    """The parts of a request for an operation. A stop goes out whatever stands in its query and headers."""

    def __init__(self, operation: Operation) -> None:
        kinds = {name: parameter.annotation for name, parameter in operation.parameters.items()}
        self._path = [
            CallPart(name, "path", kinds.get(name, NAMES.get(name, str))) for name in operation.named
        ]
        self.query = {
            name: CallPart(name, "query", parameter.annotation, _default_of(parameter))
            for name, parameter in operation.parameters.items()
            if name not in operation.named
        }
        self._stops = operation.right is Right.STOP
        heeds_keys = operation.verb in WITH_EFFECT and not self._stops
        self._refuses_keys = heeds_keys and operation.right not in READS and not operation.keyed
        self.body: CallPart | None = None
        """One without a name where nothing is taken: what asks for something is refused, not passed over."""
        if operation.request_name is not None:
            default = operation.request if operation.request_optional else None
            self.body = CallPart(operation.request_name, "body", operation.request, default)
        elif heeds_keys:
            self.body = CallPart("", "body", NoContent, NoContent)
        self._most = operation.most_bytes or MAX_BODY_BYTES
        self._plain = operation.plain
        self._media = _media_of(operation)

    def prepare(self) -> None:
        """Have the types of all parts ready, which otherwise the first request waits for."""
        for part in (*self._path, *self.query.values(), *([self.body] if self.body else [])):
            _ = part.adapter

    async def read(self, request: Request) -> dict[str, Any]:
        """Read what the operation takes.

        :raises InvalidParts: something is missing, or is not as it has to be.
        :raises InvalidRequest: a name of the query is not known, or there is a key that is not honoured.
        :raises HTTPException: 413 or 415, or 400 where the body is no JSON, 422 where that is not strict.
        """
        if not self._stops:
            require_known(request, self.query)
        if self._refuses_keys:
            require_no_key(request)
        if self.body is None:
            return self._values(request, NOTHING)
        body = await read_body(request, self._most)
        content = await self._content(request, body)
        told = partial(self._values, request, content)
        return told() if len(body) <= INLINE_BYTES else await aside(told)

    async def _content(self, request: Request, body: bytes) -> object:
        if not body and self._media == (JSON,):
            return NOTHING
        kind = JSON if self._stops else require_type(request, *self._media)
        if kind == JSON:
            return await _json(body)
        return body if self._plain is None else {self._plain: _text(body)}

    def _values(self, request: Request, content: object) -> dict[str, Any]:
        errors: list[Any] = []
        params = request.path_params
        values = {part.name: part.read(params[part.name], errors) for part in self._path}
        if self.query:
            asked: Mapping[str, Any] = request.query_params if request.scope["query_string"] else {}
            for name, part in self.query.items():
                values[name] = part.read(asked.get(name, NOTHING), errors)
        if self.body is not None:
            given = self.body.read(NOTHING if content is None else content, errors)
            values |= {self.body.name: given} if self.body.name else {}
        if errors:
            shape = self.body.annotation if self.body else None
            raise InvalidParts(errors, None if content is NOTHING else content, shape)
        return values


def _media_of(operation: Operation) -> tuple[str, ...]:
    """The media types that a request may have."""
    if operation.request_name is None or not (operation.media or operation.plain):
        return (JSON,)
    return (operation.media,) if operation.media else (JSON, TEXT)


def _default_of(parameter: Parameter) -> Callable[[], object] | None:
    default = parameter.default
    return None if default is Parameter.empty else lambda: default


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


async def _json(body: bytes) -> object:
    try:
        return await read(body)
    except NotStrict as error:
        raise HTTPException(422, f"The request is not valid: {error}; nothing was sent.") from None
    except ValueError as error:
        raise HTTPException(
            400, f"The request body is not JSON: {_where(error)}; nothing was sent."
        ) from None


def _where(error: ValueError) -> str:
    if isinstance(error, json.JSONDecodeError):
        return f"it cannot be read at line {error.lineno}, column {error.colno}"
    return "it is not UTF-8 text"


def _text(body: bytes) -> str:
    try:
        return body.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InvalidRequest("The request body is not UTF-8 text; nothing was sent.") from None


def _header(request: Request, wanted: bytes) -> bytes:
    """The first header of a name, empty where there is none; starlette's own search decodes all of them."""
    for name, value in request.scope["headers"]:
        if name == wanted:
            return bytes(value)
    return b""


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
