"""Moves at high and low speed: codes 1 and 2 (RC-420 manual 13.2, 14)."""

from typing import Annotated, Literal

from pydantic import Field

from protocols.rorze.notation import BILLION, Number, PositionRef, Pulses, Slot, Word
from protocols.rorze.row import RorzeCommand
from protocols.table import Ack, Effect, Retry

Distance = Annotated[int, Field(ge=1, lt=BILLION), Number()]
Endless = Annotated[Literal["endless"], Word(endless="Z")]

# The pages do not list 5E, 62, 65 and 66, but what they mean (21, 13.3.7) befalls moves.
MOVE_ERRORS = frozenset({*range(0x40, 0x49), 0x4A, 0x50, 0x51, 0x52, 0x55, 0x5D, 0x5E, 0x62, 0x65, 0x66})


class RelativeMove(
    RorzeCommand[Ack], moving=False, errors=MOVE_ERRORS, retry=Retry.NEVER, effect=Effect.MOTION
):
    """Base of the moves by a distance."""

    distance: Distance | PositionRef | Endless = Field(
        description="Pulses to move, or the table entry that holds them; `endless` runs until stopped."
    )
    pattern: Slot | None = Field(default=None, description="Acceleration pattern; left out, number 30.")


class AbsoluteMove(
    RorzeCommand[Ack], moving=False, errors=MOVE_ERRORS, retry=Retry.CONDITIONAL, effect=Effect.MOTION
):
    """Base of the moves to a position."""

    position: Pulses | PositionRef = Field(
        description="Position to move to, or the table entry that holds it. Encoder mode counts its own."
    )
    pattern: Slot | None = Field(default=None, description="Acceleration pattern; left out, number 30.")


class MoveClockwise(
    RelativeMove,
    code="1+M",
    args="<A[{pattern}],>{distance}",
    example=(
        "&3F1+MA[3],500",
        ">&3F1+M",
        "&3F1+MP[50]",
        ">&3F1+M",
        "&3F1+MP[+]",
        ">&3F1+M",
        "&3F1+MP[-]",
        ">&3F1+M",
        "&3F1+MZ",
        ">&3F1+M",
    ),
):
    """CW方向高速相対移動: relative move clockwise at high speed."""


class MoveCounterclockwise(
    RelativeMove,
    code="1-M",
    args="<A[{pattern}],>{distance}",
    example=(
        "&3F1-MA[3],500",
        ">&3F1-M",
        "&3F1-MP[50]",
        ">&3F1-M",
        "&3F1-MP[+]",
        ">&3F1-M",
        "&3F1-MP[-]",
        ">&3F1-M",
        "&3F1-MZ",
        ">&3F1-M",
    ),
):
    """CCW方向高速相対移動: relative move counterclockwise at high speed."""


class MoveTo(
    AbsoluteMove,
    code="1AM",
    args="<A[{pattern}],>{position}",
    example=(
        "&3F1AMA[3],500",
        ">&3F1AM",
        "&3F1AMP[50]",
        ">&3F1AM",
        "&3F1AMP[+]",
        ">&3F1AM",
        "&3F1AMP[-]",
        ">&3F1AM",
    ),
):
    """高速絶対移動: absolute move at high speed."""


class MoveClockwiseSlowly(
    RelativeMove,
    code="2+M",
    args="<A[{pattern}],>{distance}",
    example=(
        "&3F2+MA[3],500",
        ">&3F2+M",
        "&3F2+MP[50]",
        ">&3F2+M",
        "&3F2+MP[+]",
        ">&3F2+M",
        "&3F2+MP[-]",
        ">&3F2+M",
        "&3F2+MZ",
        ">&3F2+M",
    ),
):
    """CW方向低速相対移動: relative move clockwise at low speed.

    At the start speed OL of the pattern's acceleration phase, without ramps.
    """


class MoveCounterclockwiseSlowly(
    RelativeMove,
    code="2-M",
    args="<A[{pattern}],>{distance}",
    example=(
        "&3F2-MA[3],500",
        ">&3F2-M",
        "&3F2-MP[50]",
        ">&3F2-M",
        "&3F2-MP[+]",
        ">&3F2-M",
        "&3F2-MP[-]",
        ">&3F2-M",
        "&3F2-MZ",
        ">&3F2-M",
    ),
):
    """CCW方向低速相対移動: relative move counterclockwise at low speed.

    At the start speed OL of the pattern's acceleration phase, without ramps.
    """


class MoveToSlowly(
    AbsoluteMove,
    code="2AM",
    args="<A[{pattern}],>{position}",
    example=(
        "&3F2AMA[3],500",
        ">&3F2AM",
        "&3F2AMP[50]",
        ">&3F2AM",
        "&3F2AMP[+]",
        ">&3F2AM",
        "&3F2AMP[-]",
        ">&3F2AM",
    ),
):
    """低速絶対移動: absolute move at low speed.

    At the start speed OL of the pattern's acceleration phase, without ramps.
    """
