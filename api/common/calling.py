"""The parts of a request that an endpoint takes: found once, by its signature, and read at each request.

FastAPI looks for dependencies, queries, headers and cookies at every request, which takes longer than all the
rest of a read; so it describes the operations, and does not call them.
"""

from collections.abc import Callable, Mapping
from copy import deepcopy
from functools import cached_property
from inspect import Parameter, signature
from typing import Annotated, Any, Final, Literal, get_args, get_origin

from fastapi import Request
from fastapi.params import Body, Header, Query
from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from api.common.faults import InvalidParts, kinds_of
from gateway.door.table import adapter_of, names_in

NOTHING: Final = object()
"""Stands for what a request does not have."""
Place = Literal["path", "query", "header", "body"]


class CallPart:
    """A parameter of an endpoint: where a request has it, and of which type it is."""

    def __init__(self, parameter: Parameter, place: Place) -> None:
        self.name, self.place = parameter.name, place
        self.key = self.name.replace("_", "-") if place == "header" else self.name
        self.annotation = parameter.annotation
        self._default = parameter.default
        self._field = next((field for field in _told(self.annotation) if isinstance(field, FieldInfo)), None)
        self._is_text = self.annotation is str
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

    @property
    def _at(self) -> tuple[str, ...]:
        return ("body",) if self.place == "body" else (self.place, self.key)

    def _left_out(self, errors: list[Any]) -> object:
        if self._default is not Parameter.empty:
            return deepcopy(self._default)
        if self._field is not None and not self._field.is_required():
            return self._field.get_default(call_default_factory=True)
        errors.append({"type": "missing", "loc": self._at, "msg": "Field required", "input": None})
        return None


class Call:
    """An endpoint, and what it takes."""

    def __init__(self, endpoint: Callable[..., Any], path: str) -> None:
        self.body: CallPart | None = None
        self.query: dict[str, CallPart] = {}
        self._headers: list[CallPart] = []
        self._path: list[CallPart] = []
        self._request_name: str | None = None
        named = names_in(path)
        for parameter in signature(endpoint).parameters.values():
            if parameter.annotation is Request:
                self._request_name = parameter.name
            elif parameter.name in named:
                self._path.append(CallPart(parameter, "path"))
            elif any(isinstance(told, Header) for told in _told(parameter.annotation)):
                self._headers.append(CallPart(parameter, "header"))
            elif _is_body(parameter.annotation):
                self.body = CallPart(parameter, "body")
            else:
                self.query[parameter.name] = CallPart(parameter, "query")

    def prepare(self) -> None:
        """Have the types of all parts ready, which otherwise the first request waits for."""
        for part in (*self._path, *self.query.values(), *self._headers, *([self.body] if self.body else [])):
            _ = part.adapter

    def read(
        self, request: Request, path_params: Mapping[str, Any], content: object = NOTHING
    ) -> dict[str, Any]:
        """Read what the endpoint takes; `content` is the request's JSON.

        :raises InvalidParts: something is missing, or is not as it has to be.
        """
        errors: list[Any] = []
        values = {part.name: part.read(path_params[part.name], errors) for part in self._path}
        if self.query:
            asked: Mapping[str, Any] = request.query_params if request.scope["query_string"] else {}
            for part in self.query.values():
                values[part.name] = part.read(asked.get(part.key, NOTHING), errors)
        for part in self._headers:
            values[part.name] = part.read(request.headers.get(part.key, NOTHING), errors)
        if self.body is not None:
            given = NOTHING if content is None else content
            values[self.body.name] = self.body.read(given, errors)
        if errors:
            shape = self.body.annotation if self.body else None
            raise InvalidParts(errors, None if content is NOTHING else content, shape)
        if self._request_name is not None:
            values[self._request_name] = request
        return values


def _told(annotation: Any) -> tuple[Any, ...]:
    """The words of an annotation besides its type."""
    return get_args(annotation)[1:] if get_origin(annotation) is Annotated else ()


def _is_body(annotation: Any) -> bool:
    """Tell if a parameter takes JSON: by its word for it, or because it is no single value."""
    told = _told(annotation)
    if any(isinstance(mark, Query) for mark in told):
        return False
    return any(isinstance(mark, Body) for mark in told) or any(map(_is_composed, kinds_of(annotation)))


def _is_composed(kind: Any) -> bool:
    return get_origin(kind) in (list, dict) or (isinstance(kind, type) and issubclass(kind, BaseModel))
