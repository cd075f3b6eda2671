"""Status bits, end causes, and what a controller tells of itself: code 9 (RC-420 manual 13.8, 14)."""

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from protocols.rorze.notation import FlagValue, Hex, Number, Printable
from protocols.rorze.row import Question, RorzeCommand, Setting
from protocols.table import Ack, Effect, Reply, Retry

CONTROLLER_STATUS_BITS = (
    "pulses_running",
    "limit_error",
    "ems_error",
    "command_error",
    "initialisation_error",
    "range_error",
    "stall_error",
    "communication_error",
)
"""The bits of 9CD, from bit 0 up."""

END_CAUSE_BITS = ("stall", "cw_limit", "ccw_limit", "ems", "stop_command")
"""The bits of 9MD and of an end-of-move frame, from bit 0 up."""

SENSOR_BITS = ("stall", "origin", "cw_limit", "ccw_limit", "in_position", "ems")
"""The bits of CLD, from bit 0 up."""


def names_of(bits: int, names: Sequence[str]) -> list[str]:
    """Name the bits that are set; bits beyond the names are left out."""
    return [name for position, name in enumerate(names) if bits >> position & 1]


class ControllerStatus(Reply, args="{on}|{bits}"):
    """One bit of the controller status, or all of them."""

    on: FlagValue | None = Field(default=None, description="The bit asked for.")
    bits: Annotated[int, Field(ge=0, le=0xFF), Hex(2)] | None = Field(
        default=None,
        description="Bit 0 pulses running, 1 limit error, 2 EMS error, 3 command error, "
        "4 initialisation error, 5 movement range error, 6 STALL error, 7 communication error.",
    )


class GetControllerStatus(
    Question[ControllerStatus],
    code="9CD",
    args="{bit}|",
    errors=frozenset({0x4A}),
    example=("&3F9CD0", ">&3F9CD0", "&3F9CD", ">&3F9CDH01"),
):
    """コントローラ・ステータス取得: get the controller status.

    Error bits stay set until ClearControllerStatus.
    """

    bit: Annotated[int, Field(ge=0, le=7), Number()] | None = Field(
        default=None, description="The bit to read; left out, all of them."
    )


class ClearControllerStatus(
    RorzeCommand[Ack],
    code="9CS",
    retry=Retry.CONDITIONAL,
    effect=Effect.CLEARING,
    example=("&3F9CS", ">&3F9CS"),
):
    """コントローラ・ステータスのクリア: clear the error bits of the controller status.

    All but `stall_error`, which a successful origin search, QRS or PRS ends: so say the pages of 9CD and 9CS,
    against RC-420 manual 13.8.2.
    """


class EndCause(Reply, args="{bits}"):
    """Why the last move ended."""

    bits: Annotated[int, Field(ge=0, le=0x1F), Hex(2)] = Field(
        description="Bit 0 STALL, 1 CW limit, 2 CCW limit, 3 EMS, 4 stop command; "
        "no bit: a normal end, or still moving."
    )


class GetEndCause(Question[EndCause], code="9MD", example=("&3F9MD", ">&3F9MDH00")):
    """移動終了要因取得: get the cause of the end of the last move.

    Means nothing while the motor moves.
    """


class Information(Reply, args="{text}"):
    """The version of the control software, or a user comment; empty where none is set."""

    text: Annotated[str, Field(pattern=r"^[ -~]{0,60}$"), Printable(r"[ -~]{0,60}")]


CommentNumber = Annotated[int, Field(ge=1, le=7), Number()]


class GetInformation(
    Question[Information],
    code="9VD",
    args="<{comment_number}>",
    program=False,
    errors=frozenset({0x4A}),
    example=(
        "&3F9VD",
        ">&3F9VDRC-420 VerXXXX.XX by RORZE(20XX-XX-XX)",
        "&3F9VD2",
        ">&3F9VDSerial No.00000152",
    ),
):
    """RC-420情報取得: get the software version or a user comment."""

    comment_number: CommentNumber | None = Field(
        default=None, description="User comment 1-7; left out, the version."
    )


# The manual allows all but > and &. A leading @ would make the reply to 9VD an error reply. A space inside
# survives, as the example shows, although chapter 12 has spaces dropped; first or last it might not.
_COMMENT = r"(?:[!-%'-=?A-~](?:[ -%'-=?-~]{0,38}[!-%'-=?-~])?)?"


class SetUserComment(
    Setting,
    code="9VS",
    args="{comment_number},{text}",
    program=False,
    errors=frozenset({0x4A}),
    example=("&3F9VS2,Serial No.00000152", ">&3F9VS"),
):
    """ユーザーコメント設定: set a user comment.

    FIS stores it in flash.
    """

    comment_number: CommentNumber
    text: Annotated[str, Field(pattern=rf"^{_COMMENT}$", max_length=40), Printable(_COMMENT)] = Field(
        description="Up to 40 printable ASCII characters but > and &; no @ first, no space first or last."
    )
