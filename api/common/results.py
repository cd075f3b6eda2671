"""Results of operations as responses."""

from typing import Any

from fastapi import Request, Response
from pydantic import BaseModel

from api.common.problems import instance_of, wants_japanese
from api.common.requests import content_response, json_response, wait_headers
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

AGE_HEADER = "Age-Ms"


def render(request: Request, result: Result | BaseModel, waited_s: float = 0.0) -> Response:
    """Answer with what has come of an operation; `waited_s` is how long the ends of moves were waited for."""
    if isinstance(result, BaseModel):
        return json_response(result)
    in_words = isinstance(result, Stopped | MemberAnswers)  # the others are data alone
    japanese = in_words and wants_japanese(request)
    content = told(result, instance_of(request) if in_words else "", japanese=japanese)
    status, headers = _head(result, waited_s, japanese=japanese)
    respond: Any = json_response if isinstance(content, BaseModel) else content_response
    response: Response = respond(content, status, headers)
    return response


def _head(result: Result, waited_s: float, *, japanese: bool) -> tuple[int, dict[str, str]]:
    """The status of a response, and its headers."""
    match result:
        case CommandReplies() if result.at is not None:
            return 200, {AGE_HEADER: str(age_ms_of(result.at))}
        case BegunMoves():
            status = 200 if all(move.status.final for move in result.moves) else 202
            place = {} if result.group_id else {"Location": f"{result.path}/moves/{result.moves[0].id}"}
            return status, {**(wait_headers(waited_s) if waited_s else {}), **place}
        case Opened():
            return 201, {"Location": result.path}
        case Stopped():
            return 200, {"Vary": "Accept-Language", **({"Content-Language": "ja"} if japanese else {})}
        case _:
            return 200, {}
