"""Requests and answers of which one member may go alone, as plain text."""

from typing import Any, Final

from fastapi import HTTPException, Request, Response
from pydantic import BaseModel, ValidationError

from api.common import strict_json
from api.common.faults import InvalidBody
from api.common.requests import json_response
from api.common.strict_json import JSON
from gateway.door.calls import aside
from gateway.door.problems import InvalidRequest
from gateway.door.strict_json import NotStrict, parse
from gateway.door.table import Operation

TEXT: Final = "text/plain"


async def read(request: Request, operation: Operation) -> BaseModel | bytes:
    """Read a request from JSON, or its member from plain text; where the row has a media type, the bytes.

    :raises HTTPException: 413 or 415, or 400 where it is no JSON.
    :raises InvalidBody: it is another JSON.
    :raises InvalidRequest: it is not to be trusted.
    """
    kinds = (JSON, TEXT) if operation.media is None else (operation.media,)
    kind = strict_json.require_type(request, *kinds)
    content = await strict_json.read_body(request, operation.most_bytes or strict_json.MAX_BODY_BYTES)
    if operation.media is not None:
        return content
    model: type[BaseModel] = operation.request
    if kind != TEXT:
        return await aside(_from_json, content, model)
    try:
        return model.model_validate({operation.plain: content.decode("utf-8-sig")})
    except UnicodeDecodeError:
        raise InvalidRequest("The request body is not UTF-8 text; nothing was sent.") from None


def _from_json(content: bytes, model: type[BaseModel]) -> BaseModel:
    try:
        data = parse(content)
    except NotStrict as error:
        raise InvalidRequest(f"The request is not valid: {error}; nothing was sent.") from None
    except ValueError:
        raise HTTPException(400, "The request body is not JSON; nothing was sent.") from None
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise InvalidBody(error, data, model) from None


def answer(request: Request, operation: Operation, result: Any) -> Response:
    """Answer with a document, or where only text is accepted with its member alone."""
    headers = {"Vary": "Accept"}
    accepted = request.headers.get("accept", "").lower()
    if TEXT in accepted and JSON not in accepted:
        return Response(getattr(result, operation.plain or ""), media_type=TEXT, headers=headers)
    return json_response(result, headers=headers)


def taken(operation: Operation) -> dict[str, Any]:
    """The route's declaration of its request."""
    content = {JSON: {"schema": operation.request.model_json_schema()}}
    return {"requestBody": {"required": True, "content": content}}


def given(operation: Operation) -> dict[int | str, dict[str, Any]]:
    """The route's declaration of its answer."""
    return {200: {"model": operation.result, "content": {TEXT: {"schema": {"type": "string"}}}}}
