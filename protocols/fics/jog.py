"""Moving an axis by hand: JOG and small steps (C-HOST manual 2-2, 2-3)."""

from typing import Annotated

from pydantic import AfterValidator, Field

from protocols.fics.notation import AxisName, Direction, FicsWhole, expected
from protocols.fics.row import RobotAction, WhenAnswered
from protocols.table import Effect, Retry

AXIS = "X Y Z .. for a user axis, A B C .. for a motor axis, @ for theta."


class StartJog(
    RobotAction,
    code="JOG",
    args="{axis}{direction}",
    answered=WhenAnswered.AT_ONCE,
    blocked="abc",
    retry=Retry.NEVER,
    effect=Effect.MOTION,
    example=("JOG X+", "JOG"),
):
    """JOG動作の開始: start to jog an axis, which then moves until it is stopped.

    While a motor axis jogs others may be started, but no second user axis that is converted.
    """

    axis: AxisName = Field(description=AXIS)
    direction: Direction


# It is how a JOG ends, so (c) of the manual's table cannot be meant to block it.
class StopJog(
    RobotAction,
    code="JOG",
    args="{axis}",
    answered=WhenAnswered.AT_ONCE,
    blocked="ab",
    retry=Retry.STOP,
    example=("JOG X", "JOG"),
):
    """JOG動作の終了: stop to jog an axis."""

    axis: AxisName = Field(description=AXIS)


def not_zero(value: int) -> int:
    """Refuse a step that is none."""
    if value == 0:
        raise ValueError("no step at all")
    return value


Steps = Annotated[
    int,
    Field(ge=-255, le=255),
    AfterValidator(not_zero),
    expected("a whole number from -255 to 255 other than 0"),
    FicsWhole(width=3),
]


class StepAxis(
    RobotAction,
    code="JTE",
    args="{axis}{steps}",
    blocked="abc",
    retry=Retry.NEVER,
    effect=Effect.MOTION,
    example=("JTE X-10", "JTE", "JTE @255", "JTE"),
):
    """微小相対動作: move an axis by a small amount, homed or not.

    A user axis that is converted has to be homed.
    """

    axis: AxisName = Field(description=AXIS)
    steps: Steps = Field(
        description="Distance in the smallest amounts the axis displays; 1-255 in either direction."
    )
