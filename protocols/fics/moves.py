"""Moves in user coordinates (C-HOST manual 2-5, 2-6, 2-16)."""

from pydantic import Field

from protocols.fics.notation import PLACES, Coordinates, PositionNumber
from protocols.fics.row import RobotAction
from protocols.table import Effect, Retry


class AxesMove(RobotAction, args="{coordinates}", blocked="abc", effect=Effect.MOTION):
    """Base of the moves of given axes; mm, pulse or degree as each axis is set up."""

    coordinates: Coordinates = Field(description=PLACES)


class MoveRelative(AxesMove, code="LMI", retry=Retry.NEVER, example=("LMI 10,,-30.5", "LMI")):
    """相対移動: move the present unit by an amount; homing is not needed."""


class MoveAbsolute(AxesMove, code="LMA", retry=Retry.CONDITIONAL, example=("LMA 100,,-30.5", "LMA")):
    """絶対移動: move the present unit to a position."""


class MoveToPosition(
    RobotAction,
    code="POM",
    args="{position}",
    blocked="abc",
    ranged=True,
    retry=Retry.NEVER,
    effect=Effect.MOTION,
    example=("POM 1999", "POM"),
):
    """指定ポジション移動: move the present unit to a stored position."""

    position: PositionNumber = Field(description="Number of the position, 1-1999; it has to be set.")
