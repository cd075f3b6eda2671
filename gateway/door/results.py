"""The results that operations of several sections have, as they are told."""

from typing import Annotated, Any, Final

from pydantic import ConfigDict, Field, SerializeAsAny, WithJsonSchema, create_model

from gateway.core.errors import GatewayError
from gateway.core.move_record import Move
from gateway.core.records import AnswerModel
from gateway.core.targets import BegunMoves, CommandReplies, MemberAnswers, Opened, Result, Stopped
from gateway.core.times import age_ms_of
from gateway.door.problems import Problem, problem_of
from gateway.families import FAMILIES
from protocols.table import Reply

__all__ = [
    "BegunMoves",
    "CommandReplies",
    "GroupMove",
    "GroupReply",
    "MemberAnswers",
    "MemberReply",
    "Opened",
    "Result",
    "StopResult",
    "Stopped",
    "age_ms_of",
    "told",
]


class GroupMove(AnswerModel):
    """One command to a group, with one move for each member."""

    group_id: str
    moves: list[Move]


_CONFIRMED: Final = Field(
    description="True if every controller reports standstill. If false, use the hardware stop."
)
_REPORTS: Final[dict[str, Any]] = {
    family.collections[0]: list[family.stop_report]  # type: ignore[name-defined]
    for family in FAMILIES.values()
}
StopResult: Any = create_model(
    "StopResult",
    __base__=AnswerModel,
    __doc__="Progress of the stop, after two seconds at most.",
    confirmed=(bool, _CONFIRMED),
    **_REPORTS,
)


_ANY_REPLY: Final = {"anyOf": [{"type": "object", "additionalProperties": True}, {"type": "null"}]}


class MemberReply(AnswerModel):
    """The reply of one member of a group."""

    model_config = ConfigDict(frozen=True)

    body_id: str
    reply: Annotated[SerializeAsAny[Reply] | None, WithJsonSchema(_ANY_REPLY)] = Field(
        description="The member's reply, as a single body would give it; null if there is none: see `error`."
    )
    error: Problem | None = Field(description="Reason for which there is no reply.")


class GroupReply(AnswerModel):
    """The replies of a group's members to one command."""

    model_config = ConfigDict(frozen=True)

    group_id: str
    members: list[MemberReply]


def told(result: Result, instance: str = "", *, japanese: bool = False) -> Any:
    """Give the answer for a client: a model, or a structure of models; `instance` is the URL asked for."""
    match result:
        case CommandReplies():
            return {"replies": list(result.replies)} if result.listed else result.replies[0]
        case MemberAnswers():
            members = [
                _member(body_id, reply, instance, japanese=japanese)
                for body_id, reply in result.members.items()
            ]
            return {"group_id": result.group_id, "members": members}
        case BegunMoves():
            if result.group_id is None:
                return result.moves[0]
            return {"group_id": result.group_id, "moves": list(result.moves)}
        case Opened():
            return result.session
        case Stopped():
            return _stopped(result, japanese=japanese)


def _member(body_id: str, reply: Reply | GatewayError, instance: str, *, japanese: bool) -> dict[str, Any]:
    if isinstance(reply, Reply):
        return {"body_id": body_id, "reply": reply, "error": None}
    return {"body_id": body_id, "reply": None, "error": problem_of(reply, instance, japanese=japanese)}


def _stopped(result: Stopped, *, japanese: bool) -> dict[str, Any]:
    reports = {**{family.collections[0]: [] for family in FAMILIES.values()}, **result.reports}
    if japanese:
        reports = {what: [report.in_japanese() for report in those] for what, those in reports.items()}
    return {"confirmed": result.confirmed, **reports}
