"""The declarations of an operation's route in the OpenAPI document."""

from typing import Any

from fastapi import Response

from api.common import plain_text
from api.common.documentation import begins, begins_moves, words_of
from api.common.etags import IF_MATCH
from api.common.problems import DECLARED
from api.common.results import AGE_HEADER
from api.common.strict_json import JSON
from gateway.door.table import Operation

_AGE = {"description": "How old the answer is, in milliseconds.", "schema": {"type": "number"}}


def shown(operation: Operation) -> dict[str, Any]:
    """The code of a row, and the first example of its manual."""
    code = {"x-code": operation.code} if operation.code else {}
    example = operation.example() if operation.example else None
    if example is None:
        return code
    content = {JSON: {"examples": {"of the manual": {"value": example}}}}
    return {**code, "requestBody": {"content": content}}


def heeded(operation: Operation) -> dict[str, Any]:
    """The headers that it heeds, and a body that it reads itself."""
    if operation.plain is not None and operation.request is not None:
        return plain_text.taken(operation)
    return IF_MATCH if operation.expects else {}


def answers(operation: Operation) -> dict[str, Any]:
    """Its answers, by their statuses."""
    model = operation.result
    if operation.stopping is not None:
        ended = {"description": operation.over}
        return _told(model, {200: ended, 202: {"model": model, "description": operation.stopping}})
    if operation.over is not None:
        return begins(model, operation.over, operation.ended)
    if operation.moves:
        return begins_moves("/".join(operation.path.split("/")[:3]), model, operation.ended)
    if operation.opens:
        return {"status_code": 201, "response_model": model}
    if operation.media is not None and operation.documented:
        return {"response_class": Response, "responses": {**DECLARED, 200: _text(operation)}}
    if operation.may_begin is not None:
        begun = {"model": operation.may_begin, "description": "The command has started a move."}
        return _told(model, {202: begun})
    return _told(model, _at_once(operation))


def _text(operation: Operation) -> dict[str, Any]:
    """A text, with what may stand beside it."""
    told: dict[str, Any] = {"content": {operation.media: {"schema": {"type": "string"}}}}
    if operation.answered is not None:
        told["description"] = operation.answered
    return {**told, "headers": operation.beside} if operation.beside else told


def _at_once(operation: Operation) -> dict[int | str, Any]:
    """The words for an answer with nothing under way."""
    if operation.plain is not None:
        return plain_text.given(operation)
    if operation.dated:
        replied = words_of(operation.path.partition("/commands/")[0]).replied
        return {200: {"description": replied, "headers": {AGE_HEADER: _AGE}}}
    return {}


def _told(model: Any, responses: dict[int | str, Any]) -> dict[str, Any]:
    return {"response_model": model, "responses": {**DECLARED, **responses}}
