"""The operations as the OpenAPI document shows them: FastAPI describes a route for each, and serves none."""

from collections.abc import Iterable, Mapping
from inspect import Parameter, Signature
from typing import Annotated, Any, Final
from warnings import catch_warnings, simplefilter

from fastapi import Body
from fastapi.openapi.utils import get_openapi
from fastapi.routing import APIRoute
from pydantic.warnings import UnsupportedFieldAttributeWarning
from starlette.responses import Response

from api.common import schemas
from api.common.calling import JSON, TEXT
from api.common.documentation import place_of, words_of
from api.common.problems import MEDIA_TYPE
from api.common.requests import IF_MATCH
from api.common.responses import AGE_HEADER
from api.front.swagger import TITLE
from gateway.door.names import NAMES
from gateway.door.table import FAMILIES, Effect, Operation, Right

DESCRIPTION: Final = f"""\
{", and ".join(family.controllers for family in FAMILIES.values() if family.controllers)}.

Bodies are addressed by two hex digits where only one line has them (`3F`), and always with their line
(`arm.3F`); robots by their names, and their axes by unit. Errors are problem details (RFC 9457); `moved`
says whether the motor did anything. Statuses that clients repeat by themselves are sent only where nothing
was sent to a controller. A software stop does not replace a hardware stop.
"""
_KEY: Final = {
    "type": "http",
    "scheme": "bearer",
    "description": "A key of `motion-gateway keys create`, or a token of the OpenID provider in the "
    "configuration. Browsers that have signed in need none.",
}
_AGE: Final = {"description": "How old the answer is, in milliseconds.", "schema": {"type": "number"}}
_BOUND: Final = {
    "name": IF_MATCH,
    "in": "header",
    "required": False,
    "schema": {"type": "string"},
    "description": "The ETag of what was read: where it is otherwise now, nothing is changed (412).",
}
Answers = dict[int | str, dict[str, Any]]


def _problem(meaning: str) -> dict[str, Any]:
    schema = {"$ref": "#/components/schemas/Problem"}
    return {"description": meaning, "content": {MEDIA_TYPE: {"schema": schema}}}


_PROBLEMS: Final[Answers] = {
    "4XX": _problem("Refused, not possible, or the outcome is not known: `moved` says what the motor did."),
    503: _problem("Nothing was sent, and nothing will be: it may be asked again."),
}
"""The problems of every operation but the probes."""
_OF_PROBES: Final[Mapping[str, Answers]] = {
    "livez": {},
    "readyz": {503: {"description": ("A line is down, silent or being set up.")}},
}


def document(operations: Iterable[Operation], version: str, root_path: str = "") -> dict[str, Any]:
    """Describe the operations as generators of clients need it, and the key that they take."""
    with catch_warnings():  # FastAPI builds models at once
        simplefilter("ignore", UnsupportedFieldAttributeWarning)
        described = get_openapi(
            title=TITLE,
            version=version,
            description=DESCRIPTION,
            routes=[_route_of(operation) for operation in operations if operation.documented],
            servers=[{"url": root_path}] if root_path else None,
            separate_input_output_schemas=False,
        )
    schemas.complete(described)
    described["paths"] = dict(sorted(described["paths"].items(), key=place_of))
    described["components"]["securitySchemes"] = {"key": _KEY}
    described["security"] = [{"key": []}]
    return described


def _route_of(operation: Operation) -> APIRoute:
    return APIRoute(
        operation.path,
        endpoint_of(operation),
        methods=[operation.verb],
        tags=[operation.tag],
        operation_id=operation.name,
        summary=operation.title,
        description=operation.description,
        openapi_extra={
            "x-right": operation.right,
            **({"security": []} if operation.right is Right.OPEN else {}),
            **_shown(operation),
            **_heeded(operation),
            **({"x-effect": operation.effect.value} if operation.effect is Effect.MOTION else {}),
            **({"x-later": True} if operation.later else {}),
        },
        **_answers(operation),
    )


def endpoint_of(operation: Operation) -> Any:
    """A function that FastAPI sees the parameters of: those of path, request and query, in this order."""
    taken: dict[str, Any] = {name: NAMES.get(name, str) for name in operation.named}
    taken |= operation.parameters
    if operation.request_name is not None and operation.plain is None and operation.media is None:
        model = operation.request
        body = Annotated[model, Body(default_factory=model)] if operation.request_optional else model
        taken[operation.request_name] = body

    def endpoint() -> None:
        """Take what the row says."""

    endpoint.__signature__ = Signature(  # type: ignore[attr-defined]  # it is looked for there
        [_parameter(name, parameter) for name, parameter in taken.items()]
    )
    return endpoint


def _parameter(name: str, told: Any) -> Parameter:
    if isinstance(told, Parameter):
        return told.replace(kind=Parameter.KEYWORD_ONLY)
    return Parameter(name, Parameter.KEYWORD_ONLY, annotation=told)


def _shown(operation: Operation) -> dict[str, Any]:
    """The code of a row, and the first example of its manual."""
    code = {"x-code": operation.code} if operation.code else {}
    example = operation.example() if operation.example else None
    if example is None:
        return code
    content = {JSON: {"examples": {"of the manual": {"value": example}}}}
    return {**code, "requestBody": {"content": content}}


def _heeded(operation: Operation) -> dict[str, Any]:
    """The headers that it heeds, and a body of which one member may go alone, as text."""
    if operation.plain is not None and operation.request is not None:
        content = {JSON: {"schema": operation.request.model_json_schema()}}
        return {"requestBody": {"required": True, "content": content}}
    return {"parameters": [_BOUND]} if operation.expects else {}


def _answers(operation: Operation) -> dict[str, Any]:
    """Its answers, by their statuses."""
    model = operation.result
    if operation.name in _OF_PROBES:
        return {"response_model": model, "responses": _of_probe(operation)}
    if operation.stopping is not None:
        ended = {"description": operation.over}
        return _told(model, {200: ended, 202: {"model": model, "description": operation.stopping}})
    if operation.over is not None:
        return _begins(operation, operation.over)
    if operation.moves:
        words = words_of("/".join(operation.path.split("/")[:3]))
        return _begins(operation, words.over, {202: {"description": words.begun}})
    if operation.opens:
        return {"status_code": 201, **_told(model, {})}
    if operation.media is not None:
        return {"response_class": Response, "responses": {**_PROBLEMS, 200: _text(operation)}}
    if operation.may_begin is not None:
        begun = {"model": operation.may_begin, "description": "The command has started a move."}
        return _told(model, {202: begun})
    return _told(model, _at_once(operation))


def _of_probe(operation: Operation) -> Answers:
    return {
        status: {"model": operation.result, **told} for status, told in _OF_PROBES[operation.name].items()
    }


def _begins(operation: Operation, over: str, more: Answers | None = None) -> dict[str, Any]:
    """The answers of long work: 202 with its record, 200 once it is over."""
    answers: Answers = {200: {"model": operation.ended, "description": over}, **(more or {})}
    return {"status_code": 202, **_told(operation.result, answers)}


def _text(operation: Operation) -> dict[str, Any]:
    """A text, with what may stand beside it."""
    told: dict[str, Any] = {"content": {operation.media: {"schema": {"type": "string"}}}}
    if operation.answered is not None:
        told["description"] = operation.answered
    return {**told, "headers": operation.beside} if operation.beside else told


def _at_once(operation: Operation) -> Answers:
    """The words for an answer with nothing under way."""
    if operation.plain is not None:
        return {200: {"model": operation.result, "content": {TEXT: {"schema": {"type": "string"}}}}}
    if operation.dated:
        replied = words_of(operation.path.partition("/commands/")[0]).replied
        return {200: {"description": replied, "headers": {AGE_HEADER: _AGE}}}
    return {}


def _told(model: Any, answers: Answers) -> dict[str, Any]:
    return {"response_model": model, "responses": {**_PROBLEMS, **answers}}
