"""Stops and changes of speed during a move: code 5 (RC-420 manual 13.3.6, 14)."""

from typing import Annotated

from pydantic import Field

from protocols.rorze.notation import Slot, Speed, UpTo
from protocols.rorze.row import Question, RorzeCommand, Setting
from protocols.table import Ack, Effect, Reply, Retry

# The page of 5DS lists 56 only, but excludes homing in its cautions as the others do: that is 5C.
SPEED_CHANGE_ERRORS = frozenset({0x56, 0x5C})


class MoveChange(
    RorzeCommand[Ack], errors=SPEED_CHANGE_ERRORS, retry=Retry.NEVER, effect=Effect.MOTION, starts=False
):
    """Base of the changes of a running move: not while homing or interpolating."""


class Accelerate(MoveChange, code="5AS", example=("&3F5AS", ">&3F5AS")):
    """最大速度まで加速: accelerate the running move to its maximum speed OH."""


class ChangeSpeed(
    MoveChange,
    code="5CS",
    args="{speed}",
    errors=SPEED_CHANGE_ERRORS | {0x4A},
    example=("&3F5CS50000", ">&3F5CS"),
):
    """速度変更: change the speed of the running move.

    The point where deceleration starts stays as it was planned: see RC-420 manual 13.3.6.
    """

    speed: Speed = Field(description="New speed in pulses per second.")


class Decelerate(MoveChange, code="5DS", example=("&3F5DS", ">&3F5DS")):
    """起動速度まで減速: decelerate the running move to the start speed OL of its deceleration phase."""


class StopImmediately(RorzeCommand[Ack], code="5IS", retry=Retry.STOP, example=("&3F5IS", ">&3F5IS")):
    """即停止: software stop, at once.

    Sets the end cause `stop_command`.
    """


class StopDecelerating(RorzeCommand[Ack], code="5SS", retry=Retry.STOP, example=("&3F5SS", ">&3F5SS")):
    """減速停止: software stop, decelerating.

    Decelerates as SetStopSpeedSet says; sets the end cause `stop_command`.
    """


class StopSpeedSet(Reply, args="<S[{speed_set}]>"):
    """The speed parameter set of decelerating stops."""

    speed_set: Annotated[int, Field(ge=0, le=29), UpTo(2)] | None = Field(
        default=None, description="Number of the set; absent: that of the move's deceleration phase."
    )


class GetStopSpeedSet(
    Question[StopSpeedSet],
    code="5MD",
    program=False,
    example=("&3F5MD", ">&3F5MDS[12]", "&3F5MD", ">&3F5MD"),
):
    """減速停止時の速度パラメータ取得: get the speed parameter set of decelerating stops."""


class SetStopSpeedSet(
    Setting,
    code="5MS",
    args="<S[{speed_set}]>",
    moving=False,
    program=False,
    errors=frozenset({0x4A, 0x50}),
    example=("&3F5MSS[12]", ">&3F5MS", "&3F5MS", ">&3F5MS"),
):
    """減速停止時の速度パラメータ設定: set the speed parameter set of decelerating stops."""

    speed_set: Slot | None = Field(
        default=None, description="Number of the set; left out: that of the move's deceleration phase."
    )
