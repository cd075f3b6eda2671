"""Routes made of the rows of the door: this module alone knows how an operation looks over HTTP."""

from functools import cache, partial
from typing import Annotated, Any

from fastapi import Body, Request, Response
from pydantic import BaseModel

from api.common import plain_text
from api.common.declared import answers, heeded, shown
from api.common.etags import header_of, matching
from api.common.parameters import Endpoint, taking
from api.common.requests import (
    begun_response,
    content_response,
    json_response,
    new_router,
    plant_of,
    wait_headers,
    wait_s,
)
from api.common.results import render
from api.common.routes import Router
from api.common.strict_json import StrictRequest, StrictRoute
from gateway.core.operation import Operation, Rows, names_in
from gateway.core.targets import Answer, Begun, MemberAnswers, Opened, Stopped
from gateway.door.calls import carry_out
from gateway.door.documents import expectation
from gateway.door.names import NAMES

RESULTS = Answer | Begun | MemberAnswers | Opened | Stopped
WAIT = "wait"


def router(rows: Rows) -> Router:
    """Make the routes of one section's rows."""
    made = new_router(rows.tag)
    for operation in rows:
        if operation.by_hand is None and operation.http_only is None:
            add(made, operation)
    return made


def add(made: Router, operation: Operation) -> None:
    """Make the route of a row."""
    made.add(
        operation.verb,
        operation.path,
        operation.right,
        _endpoint(operation),
        route_class=_taking(operation.most_bytes),
        any_scope=operation.any_scope,
        told=partial(_told, operation),
    )


def _told(operation: Operation) -> dict[str, Any]:
    """Describe an operation for the OpenAPI document."""
    return {
        "operation_id": operation.name,
        "summary": operation.title,
        "description": operation.description,
        "openapi_extra": {**shown(operation), **heeded(operation)},
        **answers(operation),
    }


@cache
def _taking(most_bytes: int | None) -> type[StrictRoute]:
    """Routes that take longer requests than others."""
    if most_bytes is None:
        return StrictRoute
    request_class = type("LongRequest", (StrictRequest,), {"most": most_bytes})
    return type("LongRoute", (StrictRoute,), {"request_class": request_class})


def _endpoint(operation: Operation) -> Endpoint:
    """Make what answers a request: it asks the door, and puts the result into a response."""

    async def answer(request: Request, **values: Any) -> Response:
        waited_s = 0.0
        if WAIT in operation.parameters:
            waited_s = values[WAIT] = wait_s(request, values.get(WAIT))
        if operation.plain is not None and operation.request_name is not None:
            values[operation.request_name] = await plain_text.read(request, operation)
        expects = None
        if operation.expects:
            expects = expectation(values.get(operation.request_name or ""), matching(request))
        result = await carry_out(plant_of(request), operation, values, expects)
        return _response(request, operation, result, waited_s)

    return taking(answer, _signature(operation))


def _signature(operation: Operation) -> dict[str, Any]:
    """The parameters of path, request and query, in the order in which the document has them."""
    taken: dict[str, Any] = {name: NAMES.get(name, str) for name in names_in(operation.path)}
    taken |= operation.parameters
    if operation.request_name is not None and operation.plain is None:
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
    if isinstance(result, RESULTS):
        return render(request, result, waited_s)
    headers = wait_headers(waited_s)
    if operation.tagged:
        headers |= header_of(result)
    if not isinstance(result, BaseModel):
        return content_response(result, headers=headers)
    content = result.model_dump_json(exclude_unset=operation.named_only)
    return Response(content, headers=headers, media_type="application/json")


def _place(operation: Operation, record: Any) -> str:
    """Where a record is found again, by the whole address of what it is about."""
    kept = operation.kept_at or operation.path
    if operation.target is None:
        return kept
    return "/".join([*record.target.split("/"), *kept.split("/")[3:]])
