"""Routes made of the rows of the door: this module alone knows how an operation looks over HTTP."""

from collections.abc import Callable, Coroutine, Iterable, Iterator, Mapping
from functools import cache, partial
from inspect import Parameter, Signature
from typing import Annotated, Any

from fastapi import Body, Request, Response
from pydantic import BaseModel

from api.common import plain_text
from api.common.declared import answers, heeded, shown
from api.common.etags import header_of, matching
from api.common.idempotency import has_key
from api.common.requests import (
    JsonResponse,
    begun_response,
    content_response,
    json_response,
    plant_of,
    wait_headers,
    wait_s,
)
from api.common.results import render
from api.common.routes import HttpRoute, Router
from api.common.strict_json import StrictRequest, StrictRoute
from gateway.door.calls import carry_out
from gateway.door.documents import expectation
from gateway.door.names import NAMES
from gateway.door.results import Result
from gateway.door.table import Effect, Operation, PlainText, Written, names_in

WAIT = "wait"
Endpoint = Callable[..., Coroutine[Any, Any, Response]]


def routes(operations: Iterable[Operation], by_hand: Iterable[HttpRoute]) -> Iterator[HttpRoute]:
    """Give the route of each row, in the order of the documents: made here, if not written by hand."""
    written = {(method, route.path): route for route in by_hand for method in route.methods or ()}
    for operation in operations:
        yield written.get((operation.verb, operation.path)) or route_of(operation)


@cache
def route_of(operation: Operation) -> HttpRoute:
    """Make the route of a row, once for all applications: it knows no plant."""
    return Router(operation.tag, _taking(operation.most_bytes, keyed=operation.keyed)).add(
        operation.verb,
        operation.path,
        operation.right,
        _endpoint(operation),
        any_scope=operation.any_scope,
        include_in_schema=operation.documented,
        told=partial(_told, operation),
    )


def _told(operation: Operation) -> dict[str, Any]:
    """Describe an operation for the OpenAPI document."""
    return {
        "operation_id": operation.name,
        "summary": operation.title,
        "description": operation.description,
        "openapi_extra": {**shown(operation), **heeded(operation), **_effect(operation)},
        **answers(operation),
    }


def _effect(operation: Operation) -> dict[str, Any]:
    """Mark what can move a motor: of what the right `operate` is for, it is what must not come late."""
    return {"x-effect": operation.effect.value} if operation.effect is Effect.MOTION else {}


@cache
def _taking(most_bytes: int | None, *, keyed: bool) -> type[StrictRoute]:
    """Routes that take longer requests than others, or look at keys when they have read their requests."""
    told: dict[str, Any] = {"refuses_keys": False} if keyed else {}
    if most_bytes is not None:
        told["request_class"] = type("LongRequest", (StrictRequest,), {"most": most_bytes})
    return type("RowRoute", (StrictRoute,), told) if told else StrictRoute


def _endpoint(operation: Operation) -> Endpoint:
    """Make what answers a request: it asks the door, and puts the result into a response."""
    reads_itself = operation.request_name is not None and (operation.plain or operation.media)

    async def answer(request: Request, **values: Any) -> Response:
        waited_s = 0.0
        if WAIT in operation.parameters:
            waited_s = values[WAIT] = wait_s(request, values.get(WAIT))
        if reads_itself:
            values[operation.request_name or ""] = await plain_text.read(request, operation)
        expects = None
        if operation.expects:
            expects = expectation(values.get(operation.request_name or ""), matching(request))
        keyed = operation.keyed and has_key(request.scope)
        result = await carry_out(plant_of(request), operation, values, expects, keyed=keyed)
        return _response(request, operation, result, waited_s)

    return taking(answer, _signature(operation, reads_itself=bool(reads_itself)))


def _signature(operation: Operation, *, reads_itself: bool) -> dict[str, Any]:
    """The parameters of path, request and query, in the order in which the document has them."""
    taken: dict[str, Any] = {name: NAMES.get(name, str) for name in names_in(operation.path)}
    taken |= operation.parameters
    if operation.request_name is not None and not reads_itself:
        model = operation.request
        body = Annotated[model, Body(default_factory=model)] if operation.request_optional else model
        taken[operation.request_name] = body
    return taken


def _response(request: Request, operation: Operation, result: Any, waited_s: float) -> Response:
    if operation.stopping is not None:
        return json_response(result, 202 if result.state == "stopping" else 200)
    if operation.over is not None and not (operation.planned and isinstance(result, operation.planned)):
        return begun_response(result, _place(operation, result), waited_s)
    if operation.plain is not None:
        return plain_text.answer(request, operation, result)
    if isinstance(result, Result):
        return render(request, result, waited_s)
    headers = {**wait_headers(waited_s), **_tag(operation, result)}
    match result:
        case PlainText():
            return Response(result.content, headers={**headers, **result.beside}, media_type=operation.media)
        case Written():
            return JsonResponse(result.json, headers=headers)
        case BaseModel():
            content = result.model_dump_json(exclude_unset=operation.named_only)
            return JsonResponse(content, headers=headers)
    return content_response(result, headers=headers)


def _tag(operation: Operation, result: Any) -> Mapping[str, str]:
    document = result.document if isinstance(result, PlainText) else result
    return header_of(document) if operation.tagged else {}


def _place(operation: Operation, record: Any) -> str:
    """Where a record is found again, by the whole address of what it is about."""
    kept = operation.kept_at or operation.path
    if operation.target is None:
        return kept
    return "/".join([*record.target.split("/"), *kept.split("/")[3:]])


def taking(endpoint: Endpoint, parameters: Mapping[str, Any]) -> Endpoint:
    """Let FastAPI see which parameters an endpoint takes besides the request; `wait` may be left out."""
    endpoint.__signature__ = Signature(  # type: ignore[attr-defined]  # it is looked for there
        [
            parameter.replace(name=name, kind=Parameter.KEYWORD_ONLY)
            if isinstance(parameter, Parameter)
            else _of(name, parameter)
            for name, parameter in {"request": Request, **parameters}.items()
        ]
    )
    return endpoint


def _of(name: str, annotation: Any) -> Parameter:
    default = None if name == "wait" else Parameter.empty
    return Parameter(name, Parameter.KEYWORD_ONLY, annotation=annotation, default=default)
