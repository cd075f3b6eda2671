"""Routes made of the rows of the door: this module alone knows how an operation looks over HTTP."""

from typing import Annotated, Any

from fastapi import Body, Request, Response
from pydantic import BaseModel

from api.common.documentation import begins
from api.common.etags import IF_MATCH, header_of, matching
from api.common.parameters import Endpoint, taking
from api.common.requests import begun_response, content_response, new_router, plant_of, wait_headers, wait_s
from api.common.results import render
from api.common.routes import HttpRoute, Router
from api.common.strict_json import StrictRoute
from gateway.core.operation import EXPECTS, Operation, Rows, names_in
from gateway.core.targets import Answer, Begun, MemberAnswers, Opened, Stopped
from gateway.door.calls import carry_out
from gateway.door.documents import expectation
from gateway.door.names import NAMES

RESULTS = Answer | Begun | MemberAnswers | Opened | Stopped
WAIT = "wait"


def router(rows: Rows, route_class: type[HttpRoute] = StrictRoute) -> Router:
    """Make the routes of one section's rows."""
    made = new_router(rows.tag, route_class)
    for operation in rows:
        made.add(
            operation.verb,
            operation.path,
            operation.right,
            _endpoint(operation),
            operation_id=operation.name,
            summary=operation.title,
            description=operation.description,
            any_scope=operation.any_scope,
            **_declared(operation),
        )
    return made


def _declared(operation: Operation) -> dict[str, Any]:
    """What the route declares of its answers, and of the headers that it heeds."""
    declared: dict[str, Any] = IF_MATCH if operation.expects else {}
    if operation.over is not None:
        return {**declared, **begins(operation.result, operation.over)}
    return {
        **declared,
        "response_model": operation.result,
        **({"status_code": 201} if operation.opens else {}),
    }


def _endpoint(operation: Operation) -> Endpoint:
    """Make what answers a request: it asks the door, and puts the result into a response."""

    async def answer(request: Request, **values: Any) -> Response:
        waited_s = 0.0
        if WAIT in operation.parameters:
            waited_s = values[WAIT] = wait_s(request, values.get(WAIT))
        more = {}
        if operation.expects:
            more[EXPECTS] = expectation(values.get(operation.request_name or ""), matching(request))
        result = await carry_out(plant_of(request), operation, values, **more)
        return _response(request, operation, result, waited_s)

    return taking(answer, _signature(operation))


def _signature(operation: Operation) -> dict[str, Any]:
    """The parameters of path, request and query, in the order in which the document has them."""
    taken: dict[str, Any] = {name: NAMES.get(name, str) for name in names_in(operation.path)}
    taken |= operation.parameters
    if operation.request_name is not None:
        model = operation.request
        body = Annotated[model, Body(default_factory=model)] if operation.request_optional else model
        taken[operation.request_name] = body
    return taken


def _response(request: Request, operation: Operation, result: Any, waited_s: float) -> Response:
    if operation.over is not None:
        return begun_response(result, _place(operation, result), waited_s)
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
    kept = (operation.kept_at or operation.path).split("/")
    return "/".join([*record.target.split("/"), *kept[3:]])
