"""Errors, in one sentence each: what happened, what the motor did, and what to do next."""

from collections.abc import Mapping
from typing import Any, Final, Literal

PREFIX: Final = "urn:motion-gateway:problem:"

Moved = Literal["no", "yes", "unknown"]


class GatewayError(Exception):
    """A request was not carried out, or its outcome is not known.

    `moved` says whether the motor did anything because of the request, `remedy` what to do next, `retryable`
    whether the same request may succeed later. `request_id` is what the gateway's trace has it under.
    """

    type: str = f"{PREFIX}gateway-error"
    detail: str
    moved: Moved
    remedy: str
    retryable: bool
    request_id: str | None

    def __init__(
        self,
        detail: str,
        *,
        type: str | None = None,  # noqa: A002  # as RFC 9457 calls it
        moved: Moved = "unknown",
        remedy: str = "",
        retryable: bool = False,
        request_id: str | None = None,
    ) -> None:
        super().__init__(f"{detail} {remedy}".strip())
        self.type = type or self.type
        self.detail, self.moved, self.remedy = detail, moved, remedy
        self.retryable, self.request_id = retryable, request_id

    @property
    def kind(self) -> str:
        """The last word of `type`, such as `body-busy`; it never changes."""
        return self.type.removeprefix(PREFIX)


class Refused(GatewayError):
    """The gateway has answered with a problem (RFC 9457)."""

    def __init__(self, status: int, problem: Mapping[str, Any]) -> None:
        super().__init__(
            problem.get("detail", f"The answer has status {status}."),
            type=problem.get("type"),
            moved=problem.get("moved", "unknown"),
            remedy=problem.get("remedy", ""),
            retryable=problem.get("retryable", False),
            request_id=problem.get("request_id"),
        )
        self.status = status
        self.title: str = problem.get("title", "")
        self.code: str | None = problem.get("code")
        """The controller's error code, such as 0x51 or E05."""
        self.errors: list[dict[str, str]] = problem.get("errors") or []
        """Every part of the request that is not valid: its `field` and a `message`."""


class NoAnswer(GatewayError):
    """The gateway could not be reached, or the connection broke before it had answered."""

    type = f"{PREFIX}no-answer"


class MoveNotSucceeded(GatewayError):
    """A move that was waited for has ended, and not as it should."""

    type = f"{PREFIX}move-not-succeeded"

    def __init__(self, move: Mapping[str, Any]) -> None:
        error = move["error"] or {}
        ended = f"The move {move['id']} of {move['body_id']} has ended: {move['status']}."
        super().__init__(
            f"{ended} {error.get('detail', '')}".strip(),
            type=f"{PREFIX}{error['type']}" if error else None,
            moved=error.get("moved", "unknown"),
            remedy=error.get("remedy", ""),
            request_id=move["request_id"],
        )
        self.move = move


class MoveNotOver(GatewayError, TimeoutError):
    """A move that was waited for is still under way; nothing was done about it."""

    type = f"{PREFIX}move-not-over"
