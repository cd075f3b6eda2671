"""Errors as they are told: what happened, what was and was not done to the motor, and what to do next."""

from collections.abc import Mapping, Sequence
from typing import Final, Literal

from pydantic import BaseModel, Field

from gateway.access.errors import CookieAlone, NotAuthenticated, NothingShown, NotPermitted
from gateway.core.errors import (
    Ambiguous,
    ControllerError,
    ControllerRefused,
    GatewayError,
    InvalidRequest,
    InvalidText,
    Moved,
    NotAllowed,
    NotFound,
    NotSent,
    Outdated,
)
from gateway.core.next_calls import NextCall
from gateway.core.origin import current
from gateway.texts import Text, entry, has, text

__all__ = [
    "TYPE_PREFIX",
    "Ambiguous",
    "CookieAlone",
    "GatewayError",
    "InvalidField",
    "InvalidRequest",
    "NextCall",
    "NotAuthenticated",
    "NotPermitted",
    "NothingShown",
    "Outdated",
    "Problem",
    "problem_of",
    "put_in_japanese",
]

TYPE_PREFIX: Final = "urn:motion-gateway:problem:"

_STATUS: Final[Mapping[type[GatewayError], int]] = {
    NotAuthenticated: 401,
    NotPermitted: 403,
    NotFound: 404,
    Ambiguous: 409,
    Outdated: 412,
    InvalidRequest: 422,
    NotAllowed: 403,
    NotSent: 503,
    GatewayError: 409,
}


class InvalidField(BaseModel):
    """One fault of the request, and the field it is in."""

    field: str = Field(description="Path of the field in the request, such as distance.value.")
    message: str
    line: int | None = Field(default=None, description="Number of the line in a text of many lines, from 1.")
    column: int | None = Field(default=None, description="Number of the character in that line, from 1.")


class Problem(BaseModel):
    """The reason for which a request was not carried out (RFC 9457)."""

    type: str = Field(description=f"The kind of error, {TYPE_PREFIX}KIND; never changes.")
    title: str = Field(description="The kind of error in words.")
    status: int = Field(description="The HTTP status.")
    detail: str = Field(
        description="One sentence: what happened, and what was and was not done to the motor."
    )
    instance: str = Field(description="The path that was asked for.")
    moved: Moved = Field(
        description="Says if the motor did anything because of this request: no, yes or unknown."
    )
    remedy: str = Field(description="The next step for the caller.")
    retryable: bool = Field(description="True if the same request may succeed later.")
    request_id: str | None = Field(
        default_factory=lambda: current().request_id,
        description="The header X-Request-Id of this answer, which the line's trace has too.",
    )
    code: str | None = Field(default=None, description="The controller's error code, such as 0x51 or E05.")
    next: list[NextCall] | None = Field(
        default=None, description="The calls that help, in the order in which they do."
    )
    errors: list[InvalidField] | None = Field(default=None, description="Every part that is not valid.")


def problem_of(
    error: GatewayError, instance: str, calls: Sequence[NextCall] = (), *, japanese: bool = False
) -> Problem:
    """Describe an error, with the calls that help; in Japanese, if that is wanted."""
    problem = Problem(
        type=TYPE_PREFIX + error.kind,
        title=error.title,
        status=_status_of(error),
        detail=error.detail,
        instance=instance,
        moved=error.moved,
        remedy=error.remedy,
        retryable=error.retryable,
        code=error.error_code if isinstance(error, ControllerError) else None,
        next=list(calls or error.next) or None,
    )
    if isinstance(error, InvalidText):
        problem.errors = [
            InvalidField(field=error.field, message=fault.reason, line=fault.line, column=fault.column)
            for fault in error.faults
        ]
    if japanese:
        _translate(problem, error)
    return problem


def _translate(problem: Problem, error: GatewayError) -> None:
    if not error.detail_ja:
        put_in_japanese(problem)
        return
    problem.title = error.title_ja
    problem.detail = error.detail_ja
    problem.remedy = error.remedy_ja or problem.remedy


def put_in_japanese(problem: Problem) -> None:
    """Say what kind of refusal it is, what became of the motor, and what helps; the rest stays English."""
    kind = problem.type.removeprefix(TYPE_PREFIX)
    if has(f"remedies.{kind}"):
        problem.remedy = text(f"remedies.{kind}", remedy=problem.remedy).ja
    if has(f"problems.{kind}"):
        problem.title = text(f"problems.{kind}.title").ja
        moved = text(f"moved.{problem.moved}").ja
        problem.detail = f"{problem.title}。{moved}（{problem.detail}）"


def how_to_stop(path: str, stops: Literal["one", "all"]) -> tuple[Text, Text]:
    """Say what stops, and at once, of a stop that was refused."""
    return text(f"stops.{stops}", path=path), text("stops.remedy", path=path)


def words_of_page(page: str, *, japanese: bool) -> Mapping[str, str]:
    """Find what a page without a script says, by its parts."""
    words: Mapping[str, str] = entry("ja" if japanese else "en", f"pages.{page}")
    return words


def _status_of(error: GatewayError) -> int:
    if isinstance(error, ControllerRefused) and error.lasting:
        return 422
    if isinstance(error, NotSent) and not error.retryable:
        # A client that repeats it would move what somebody has stopped, or has to look after first.
        return 409
    return next(_STATUS[kind] for kind in type(error).__mro__ if kind in _STATUS)
