"""Results of operations as responses."""

from collections.abc import Mapping
from typing import Any, Final

from pydantic import BaseModel
from pydantic_core import to_json
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from api.common.calling import JSON, TEXT
from api.common.problems import instance_of, wants_japanese
from gateway.door.documents import tag_of
from gateway.door.results import (
    BegunMoves,
    CommandReplies,
    MemberAnswers,
    Opened,
    Result,
    Stopped,
    age_ms_of,
    told,
)
from gateway.door.table import Operation, PlainText, Written

AGE_HEADER: Final = "Age-Ms"
_NO_HEADERS: Final[Mapping[str, str]] = {}


class JsonResponse(Response):
    """JSON that is written already. Starlette's response finds out more of itself than there is to find."""

    def __init__(
        self, content: str | bytes, status: int = 200, headers: Mapping[str, str] = _NO_HEADERS
    ) -> None:
        self.status_code, self.background = status, None
        self.body = content.encode() if isinstance(content, str) else content
        self.raw_headers = [
            *((name.lower().encode("latin-1"), value.encode("latin-1")) for name, value in headers.items()),
            (b"content-length", b"%d" % len(self.body)),
            (b"content-type", b"application/json"),
        ]

    async def __call__(self, _scope: Scope, _receive: Receive, send: Send) -> None:
        """Send it."""
        head = {"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers}
        await send(head)
        await send({"type": "http.response.body", "body": self.body})


def json_response(content: object, status: int = 200, headers: Mapping[str, str] = _NO_HEADERS) -> Response:
    """Answer with what the gateway itself has made, which needs no validation."""
    text = content.model_dump_json() if isinstance(content, BaseModel) else to_json(content)
    return JsonResponse(text, status, headers)


def wait_headers(waited_s: float) -> dict[str, str]:
    """Tell the client for how long its wish to wait was granted (RFC 7240)."""
    return {"Preference-Applied": f"wait={waited_s:g}"} if waited_s else {}


def response_of(request: Request, operation: Operation, result: Any, waited_s: float) -> Response:
    """Answer with what an operation gives; `waited_s` is how long the end of something was waited for."""
    if operation.stopping is not None:
        return json_response(result, 202 if result.state == "stopping" else 200)
    if operation.over is not None and not (operation.planned and isinstance(result, operation.planned)):
        headers = {"Location": f"{_place(operation, result)}/{result.id}", **wait_headers(waited_s)}
        return json_response(result, 202 if result.status == "running" else 200, headers)
    if operation.plain is not None:
        return _with_text(request, operation.plain, result)
    if isinstance(result, Result):
        return render(request, result, waited_s)
    headers = {**wait_headers(waited_s), **_tag(operation, result)}
    match result:
        case PlainText():
            return Response(result.content, headers={**headers, **result.beside}, media_type=operation.media)
        case Written():
            return JsonResponse(result.json, headers=headers)
        case BaseModel() if operation.named_only:
            return JsonResponse(result.model_dump_json(exclude_unset=True), headers=headers)
    return json_response(result, headers=headers)


def etag_of(document: BaseModel) -> str:
    """The strong tag of what a document says."""
    return f'"{tag_of(document)}"'


def header_of(document: BaseModel) -> dict[str, str]:
    """The header with the tag of a document."""
    return {"ETag": etag_of(document)}


def _tag(operation: Operation, result: Any) -> Mapping[str, str]:
    document = result.document if isinstance(result, PlainText) else result
    return header_of(document) if operation.tagged else _NO_HEADERS


def _place(operation: Operation, record: Any) -> str:
    """Where a record is found again, by the whole address of what it is about."""
    kept = operation.kept_at or operation.path
    if operation.target is None:
        return kept
    return "/".join([*record.target.split("/"), *kept.split("/")[3:]])


def _with_text(request: Request, member: str, document: BaseModel) -> Response:
    """Answer with a document, or where only text is accepted with its member alone."""
    headers = {"Vary": "Accept"}
    accepted = request.headers.get("accept", "").lower()
    if TEXT in accepted and JSON not in accepted:
        return Response(getattr(document, member), media_type=TEXT, headers=headers)
    return json_response(document, headers=headers)


def render(request: Request, result: Result, waited_s: float = 0.0) -> Response:
    """Answer with what has come of a command; errors of members are told as those of the whole are."""
    in_words = isinstance(result, Stopped | MemberAnswers)  # the others are data alone
    japanese = in_words and wants_japanese(request)
    content = told(result, instance_of(request) if in_words else "", japanese=japanese)
    status, headers = _head(result, waited_s, japanese=japanese)
    return json_response(content, status, headers)


def _head(result: Result, waited_s: float, *, japanese: bool) -> tuple[int, dict[str, str]]:
    """The status of a response, and its headers."""
    match result:
        case CommandReplies() if result.at is not None:
            return 200, {AGE_HEADER: str(age_ms_of(result.at))}
        case BegunMoves():
            status = 200 if all(move.status.final for move in result.moves) else 202
            place = {} if result.group_id else {"Location": f"{result.path}/moves/{result.moves[0].id}"}
            return status, {**wait_headers(waited_s), **place}
        case Opened():
            return 201, {"Location": result.path}
        case Stopped():
            return 200, {"Vary": "Accept-Language", **({"Content-Language": "ja"} if japanese else {})}
        case _:
            return 200, {}
