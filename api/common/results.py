"""Results of operations as responses."""

from collections.abc import Sequence
from typing import Annotated, Any, Final

from fastapi import Request, Response
from pydantic import BaseModel, ConfigDict, Field, SerializeAsAny, WithJsonSchema

from api.common.problems import Problem, instance_of, problem_of, wants_japanese
from api.common.requests import content_response, json_response, wait_headers
from gateway.core.errors import GatewayError
from gateway.core.stops import Report
from gateway.core.targets import Answer, Begun, MemberAnswers, Opened, Result, Stopped
from gateway.core.times import age_ms_of
from protocols.table import Reply

AGE_HEADER = "Age-Ms"


_ANY_REPLY: Final = {"anyOf": [{"type": "object", "additionalProperties": True}, {"type": "null"}]}


class MemberReply(BaseModel):
    """What one member answered."""

    model_config = ConfigDict(frozen=True)

    body_id: str
    reply: Annotated[SerializeAsAny[Reply] | None, WithJsonSchema(_ANY_REPLY)] = Field(
        description="As the same command to a single body is answered; null if there is none: see `error`."
    )
    error: Problem | None = Field(description="Why there is no reply.")


class GroupReply(BaseModel):
    """What the members of a group answered to one command."""

    model_config = ConfigDict(frozen=True)

    group_id: str
    members: list[MemberReply]


def render(request: Request, result: Result | BaseModel, waited_s: float = 0.0) -> Response:
    """Answer with what has come of an operation; `waited_s` is how long the ends of moves were waited for."""
    match result:
        case Answer():
            return _answer(result)
        case MemberAnswers():
            return _member_answers(request, result)
        case Begun():
            return _begun(result, waited_s)
        case Opened():
            return json_response(result.session, 201, {"Location": result.path})
        case Stopped():
            return _stopped(request, result)
        case _:
            return json_response(result)


def _answer(answer: Answer) -> Response:
    headers = None if answer.at is None else {AGE_HEADER: str(age_ms_of(answer.at))}
    if answer.listed:
        return content_response({"replies": list(answer.replies)}, headers=headers)
    return json_response(answer.replies[0], headers=headers)


def _member_answers(request: Request, answers: MemberAnswers) -> Response:
    members = [_member(request, body_id, reply) for body_id, reply in answers.members.items()]
    return content_response({"group_id": answers.group_id, "members": members})


def _member(request: Request, body_id: str, reply: Reply | GatewayError) -> dict[str, Any]:
    if isinstance(reply, Reply):
        return {"body_id": body_id, "reply": reply, "error": None}
    problem = problem_of(reply, instance_of(request), japanese=wants_japanese(request))
    return {"body_id": body_id, "reply": None, "error": problem}


def _stopped(request: Request, result: Stopped) -> Response:
    """Tell how far stops have come, in the language of who asked."""
    reports: dict[str, Sequence[Report]] = {"bodies": [], "robots": [], **result.reports}
    headers = {"Vary": "Accept-Language"}
    if wants_japanese(request):
        reports = {what: [it.in_japanese() for it in those] for what, those in reports.items()}
        headers["Content-Language"] = "ja"
    return content_response({"confirmed": result.confirmed, **reports}, headers=headers)


def _begun(begun: Begun, waited_s: float) -> Response:
    status = 200 if all(move.status.final for move in begun.moves) else 202
    headers = wait_headers(waited_s)
    if begun.group_id is not None:
        return content_response({"group_id": begun.group_id, "moves": list(begun.moves)}, status, headers)
    headers["Location"] = f"{begun.path}/moves/{begun.moves[0].id}"
    return json_response(begun.moves[0], status, headers)
