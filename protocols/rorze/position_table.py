"""The table of 2048 position entries and its index: code 3 (RC-420 manual 13.4, 14)."""

from typing import Annotated

from pydantic import AfterValidator, Field, WithJsonSchema

from protocols.rorze.notation import BILLION, Digits, Number, PositionRef, Pulses, SignedValue
from protocols.rorze.position import SignedPulses
from protocols.rorze.row import Question, RorzeCommand, Setting
from protocols.table import Ack, Effect, Reply, Retry

# The pages list 4A only; an index stepped past the table is 5D (13.4.3).
ENTRY_ERRORS = frozenset({0x4A, 0x5D})


def not_zero(value: int) -> int:
    """Refuse to divide by zero."""
    if value == 0:
        raise ValueError("an entry cannot be divided by zero")
    return value


Divisor = Annotated[
    int,
    Field(gt=-BILLION, lt=BILLION),
    AfterValidator(not_zero),
    WithJsonSchema(
        {"type": "integer", "exclusiveMinimum": -BILLION, "exclusiveMaximum": BILLION, "not": {"const": 0}}
    ),
    Number(),
]


class EntryArithmetic(RorzeCommand[Ack], errors=ENTRY_ERRORS, retry=Retry.NEVER, effect=Effect.SETTING):
    """Base of the four operations on an entry."""

    entry: PositionRef


class AddToPositionEntry(
    EntryArithmetic, code="3+S", args="{entry},{amount}", example=("&3F3+SP[25],50", ">&3F3+S")
):
    """ポジションパルス加算: add an amount to a position entry."""

    amount: Pulses


class SubtractFromPositionEntry(
    EntryArithmetic, code="3-S", args="{entry},{amount}", example=("&3F3-SP[25],50", ">&3F3-S")
):
    """ポジションパルス減算: subtract an amount from a position entry."""

    amount: Pulses


class MultiplyPositionEntry(
    EntryArithmetic, code="3*S", args="{entry},{factor}", example=("&3F3*SP[25],50", ">&3F3*S")
):
    """ポジションパルス乗算: multiply a position entry."""

    factor: Pulses


class DividePositionEntry(
    EntryArithmetic, code="3/S", args="{entry},{divisor}", example=("&3F3/SP[25],50", ">&3F3/S")
):
    """ポジションパルス除算: divide a position entry."""

    divisor: Divisor


class ClearPositionEntries(
    RorzeCommand[Ack],
    code="3CS",
    errors=frozenset({0x4A}),
    retry=Retry.CONDITIONAL,
    effect=Effect.SETTING,
    example=("&3F3CS", ">&3F3CS"),
):
    """全ポジションパルスのクリア: set all position entries to 0."""


class PositionIndex(Reply, args="{position}"):
    """Where `next` and `previous` point."""

    position: Annotated[int, Field(ge=0, le=2047), Digits(4)]


class GetPositionIndex(
    Question[PositionIndex],
    code="3ID",
    errors=ENTRY_ERRORS,
    example=("&3F3ID", ">&3F3ID0050"),
):
    """ポジションインデックス取得: get the position index."""


class SetPositionIndex(
    Setting,
    code="3IS",
    args="{position}",
    errors=frozenset({0x4A}),
    example=("&3F3IS2045", ">&3F3IS"),
):
    """ポジションインデックス設定: set the position index."""

    position: Annotated[int, Field(ge=0, le=2047, description="Position number, initially 0."), Number()]


class NumberedPositionEntry(Reply, args="P[{position}],{pulses}"):
    """A position entry with its number."""

    position: Annotated[int, Field(ge=0, le=2047), Digits(4)]
    pulses: SignedValue = Field(description="Position or amount, in pulses; encoder counts in encoder mode.")


class GetNumberedPositionEntry(
    Question[NumberedPositionEntry],
    code="3ND",
    args="{entry}",
    program=False,
    errors=ENTRY_ERRORS,
    echo=("position",),
    example=(
        "&3F3NDP[25]",
        ">&3F3NDP[0025],+000000050",
        "&3F3NDP[+]",
        ">&3F3NDP[0025],+000000050",
        "&3F3NDP[-]",
        ">&3F3NDP[0025],+000000050",
    ),
):
    """ポジションナンバー付きポジションパルス取得: get a position entry with its number."""

    entry: PositionRef

    @property
    def position(self) -> int | None:
        """The number that the reply repeats; None where only the controller knows it."""
        position = self.entry.position
        return position if isinstance(position, int) else None


class GetPositionEntry(
    Question[SignedPulses],
    code="3PD",
    args="{entry}",
    errors=ENTRY_ERRORS,
    example=(
        "&3F3PDP[25]",
        ">&3F3PD+000000050",
        "&3F3PDP[+]",
        ">&3F3PD+000000050",
        "&3F3PDP[-]",
        ">&3F3PD+000000050",
    ),
):
    """ポジションパルス取得: get a position entry."""

    entry: PositionRef


class SetPositionEntry(
    Setting,
    code="3PS",
    args="{entry}<,{pulses}>",
    errors=ENTRY_ERRORS,
    example=(
        "&3F3PSP[25],50",
        ">&3F3PS",
        "&3F3PSP[25]",
        ">&3F3PS",
        "&3F3PSP[+],50",
        ">&3F3PS",
        "&3F3PSP[-],50",
        ">&3F3PS",
    ),
):
    """ポジションパルス設定: set a position entry."""

    entry: PositionRef
    pulses: Pulses | None = Field(
        default=None, description="Position or amount; left out, the present position is stored."
    )
