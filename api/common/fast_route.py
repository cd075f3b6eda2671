"""Endpoints called with what stands in path, query and body, without FastAPI's search for all else.

FastAPI looks for dependencies, queries, headers and cookies at every request, which takes longer than all
the rest of a read. It still answers each request whose path or query is wrong.
"""

from collections.abc import Awaitable, Mapping
from inspect import iscoroutinefunction
from typing import Any, Final, Protocol, get_args, get_origin

from fastapi import Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.routing import APIRoute
from pydantic.fields import FieldInfo
from starlette.datastructures import QueryParams

NOTHING: Final = object()
"""Stands for the body of a request that has none."""
_MANY: Final = (list, tuple, set, frozenset)
NO_QUERY: Final = QueryParams()


class Field(Protocol):
    """A parameter, or a body, as FastAPI keeps it with its route."""

    name: str
    field_info: FieldInfo

    def validate(
        self, value: object, values: dict[str, Any] = ..., *, loc: tuple[int | str, ...] = ...
    ) -> tuple[Any, list[dict[str, Any]]]:
        """Read a value; give it, and what is wrong with it."""


class NotPlain(Exception):
    """FastAPI has to say what is wrong with a request."""


class FastCall:
    """A route's endpoint, which takes nothing from a request but path, query and body."""

    def __init__(self, route: APIRoute) -> None:
        takes, self._endpoint = route.dependant, route.endpoint
        self._request_name = takes.request_param_name
        self._checked = [it for it in takes.path_params if not _is_text(it.field_info)]
        self._query = {it.alias: it for it in takes.query_params if _is_one_value(it.field_info)}
        self._body = takes.body_params[0] if takes.body_params else None

    @classmethod
    def of(cls, route: APIRoute) -> "FastCall | None":
        """That of a route, if nothing else can be in a request for it."""
        takes, endpoint = route.dependant, route.endpoint
        answers = iscoroutinefunction(endpoint) and endpoint.__annotations__.get("return") is Response
        others = (takes.dependencies, takes.header_params, takes.cookie_params, takes.body_params[1:])
        needs_query = any(it.field_info.is_required() for it in takes.query_params)
        return None if not answers or needs_query or any(others) else cls(route)

    def begin(
        self,
        request: Request,
        path_params: Mapping[str, Any],
        body: object = NOTHING,
        query: QueryParams = NO_QUERY,
    ) -> Awaitable[Response]:
        """Begin to answer.

        :raises NotPlain: a part of path or query is not what the endpoint takes, or the body is missing;
            nothing was begun.
        :raises RequestValidationError: the body alone is not.
        """
        values: dict[str, Any] = {**path_params}
        for field in self._checked:
            values[field.name] = _valid(field, values[field.name])
        for name, value in query.multi_items():
            asked = self._query.get(name)
            if asked is None or asked.name in values:
                raise NotPlain
            values[asked.name] = _valid(asked, value)
        if self._body is not None:
            values[self._body.name] = _valid_body(self._body, body)
        if self._request_name is not None:
            values[self._request_name] = request
        answering: Awaitable[Response] = self._endpoint(**values)
        return answering


def _is_text(field: FieldInfo) -> bool:
    """Whether every part of a path is good for it."""
    return field.annotation is str and not field.metadata


def _is_one_value(field: FieldInfo) -> bool:
    """Whether it takes what stands in a query once."""
    kinds = (field.annotation, *get_args(field.annotation))
    return not any((get_origin(kind) or kind) in _MANY for kind in kinds)


def _valid(field: Field, given: object) -> object:
    if given is NOTHING and not field.field_info.is_required():
        return field.field_info.get_default(call_default_factory=True)
    valid, errors = field.validate(given)
    if errors:
        raise NotPlain
    return valid


def _valid_body(field: Field, given: object) -> object:
    """Read a body, valid or not: FastAPI would read a long one again, and hold the loop."""
    if given is NOTHING or given is None:
        return _valid(field, given)
    valid, errors = field.validate(given, loc=("body",))
    if errors:
        raise RequestValidationError(errors, body=given)
    return valid
