"""The record of every move, of a body or of a robot's unit: its life from the request to the end."""

from collections.abc import Sequence
from datetime import datetime
from enum import StrEnum
from typing import Final, Literal, Self

from pydantic import Field
from typing_extensions import TypeAliasType

from gateway.core.errors import ControllerError, GatewayError, Moved
from gateway.core.marks import DETAIL
from gateway.core.next_calls import NextCall
from gateway.core.records import Record, RequestModel, request_id_field
from protocols.members import at_hand

LOST_AFTER_S = 30.0
"""Seconds of silence in the middle of a move after which the gateway gives the move up as lost."""

START_WITHIN_S = 5.0
"""Default time within which a move is written after its request, or never, in seconds."""

RESTARTED: Final = "the gateway was restarted"
"""Why a move goes on with another than has begun it, as the begin or the end of a sentence."""

CountedIn = TypeAliasType("CountedIn", Literal["pulses", "encoder_counts"])
Completion = TypeAliasType("Completion", Literal["frame", "polling"])
MoveKind = TypeAliasType(
    "MoveKind", Literal["relative", "absolute", "home", "continuous", "jog", "interpolated"]
)


@at_hand
class MoveStatus(StrEnum):
    """Where a move is in its life."""

    QUEUED = "queued"
    SENT = "sent"
    MOVING = "moving"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    STOPPED = "stopped"
    REJECTED = "rejected"
    CANCELLED = "cancelled"
    LOST = "lost"
    UNKNOWN = "unknown"

    @property
    def final(self) -> bool:
        """True if the status is the last one."""
        return self not in (MoveStatus.QUEUED, MoveStatus.SENT, MoveStatus.MOVING)


class MoveError(Record):
    """Why a move did not succeed, in the words of a problem detail."""

    type: str = Field(description="The kind of error; stable.")
    title: str
    detail: str
    moved: Moved = Field(
        description="Says if the motor did anything because of this move: no, yes or unknown."
    )
    remedy: str
    controller_error: str | None = Field(
        default=None, description="The controller's error code, such as 0x51."
    )
    next: list[NextCall] = Field(default_factory=list, description="The calls that help.")

    @classmethod
    def of(cls, error: GatewayError, calls: Sequence[NextCall] = ()) -> Self:
        """An error as it stands in a move."""
        return cls(
            type=error.kind,
            title=error.title,
            detail=error.detail,
            moved=error.moved,
            remedy=error.remedy,
            controller_error=error.error_code if isinstance(error, ControllerError) else None,
            next=list(calls),
        )


class StartRequest(RequestModel):
    """A move to be started, of a body, a group or a unit."""

    validate_only: bool = Field(
        default=False,
        description="True to be told what would be sent and how long it would take; nothing moves.",
    )
    start_within_s: float = Field(
        default=START_WITHIN_S,
        gt=0,
        le=60,
        description="Seconds the move may wait for its turn; if it is not sent by then, it never is.",
    )


class MoveRecord(Record):
    """One move, from the request to its end."""

    id: str
    body_id: str = Field(description="Address of what moves: a body, LINE.3F, or a unit, ROBOT/units/1.")
    status: MoveStatus = MoveStatus.QUEUED
    command: str = Field(description="The three characters of the controller's command.")
    frame: str = Field(description="The exact bytes, CR as \\r.")
    evidence: list[str] = Field(
        default_factory=list, description="Observations that the status rests on, in words."
    )
    error: MoveError | None = None
    request_id: str | None = request_id_field()
    created_at: datetime
    sent_at: datetime | None = None
    acknowledged_at: datetime | None = None
    ended_at: datetime | None = None
    event_cursor: str = Field(
        default="", description="Cursor after which the events include all later news of the move."
    )


class Move(MoveRecord):
    """One move of one body."""

    group_id: str | None = Field(
        default=None, description="Id of the group that the command was sent to, if any."
    )
    kind: MoveKind
    end_cause: str | None = Field(
        default=None,
        description="Cause of the end. By the controller: normal, stall, cw_limit, ccw_limit, ems, "
        "stop_command, or several joined by +; by the gateway: not_executed, position_mismatch "
        "or not_in_position.",
    )
    counted_in: CountedIn | None = Field(
        default=None,
        description="Unit of the positions; null if the body's operating mode is not known.",
    )
    start_position: int | None = Field(default=None, description="Position before the move, in `counted_in`.")
    target_position: int | None = Field(
        default=None, description="Position to reach, in `counted_in`; null if it cannot be known beforehand."
    )
    position: int | None = Field(default=None, description="Position as last read, in `counted_in`.")
    homing_distance: int | None = Field(
        default=None,
        description="Distance from the end of a good homing back to its start, in `counted_in` (0PD).",
    )
    completion: Completion | None = Field(
        default=None,
        description="`frame`: the link master announced the end; `polling`: the gateway found it.",
        json_schema_extra=DETAIL,
    )
