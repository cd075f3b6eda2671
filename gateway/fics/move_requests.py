"""Moves of units in the words of clients: their kinds, and the commands they come to."""

from typing import Annotated, Any, Final, Literal

from pydantic import Field

from gateway.core.move_record import StartRequest
from gateway.core.records import example
from gateway.fics.amounts import AxisAmounts, build, numbers
from gateway.fics.axes import CoordinateSystem, UnitAxes
from protocols.fics import motor_axes, moves
from protocols.fics.homing import HomeRobot
from protocols.fics.jog import StepAxis, Steps
from protocols.fics.notation import AxisName, PercentNumber, PositionNumber
from protocols.fics.row import FicsCommand

MotionRow = type[FicsCommand[Any]]
_ABSOLUTE: Final[dict[CoordinateSystem, MotionRow]] = {
    "user": moves.MoveAbsolute,
    "motor": motor_axes.MoveMotorsAbsolute,
}
_RELATIVE: Final[dict[CoordinateSystem, MotionRow]] = {
    "user": moves.MoveRelative,
    "motor": motor_axes.MoveMotorsRelative,
}


SpeedPercent = Annotated[
    PercentNumber | None,
    Field(
        description="Percent of full speed, 0.1-100, for this move: the gateway sets it for all axes of the "
        "unit before (VAO, MAO), and it stays so until it is set otherwise, or the power goes. Left out, the "
        "move runs at what is set. JOG and JTE have a speed of the robot's own."
    ),
]


class _AxesMoveRequest(StartRequest):
    speed_percent: SpeedPercent = None
    coordinates: CoordinateSystem = Field(
        default="user",
        description="Coordinates of the axes: those of the user or of the motors (C-HOST manual 1-6).",
    )
    axes: AxisAmounts = Field(description="Amounts by name; an axis that is not named stays where it is.")

    def _built(self, row: MotionRow, unit: UnitAxes) -> FicsCommand[Any]:
        names = unit.names(self.coordinates)
        return build("axes", row, coordinates=numbers("axes", unit, names, self.axes))


class RobotAbsoluteMoveRequest(
    _AxesMoveRequest, json_schema_extra=example(kind="absolute", axes={"X": {"value": 10, "unit": "mm"}})
):
    """Move axes to a position (C-HOST manual 2-6, 4-3)."""

    kind: Literal["absolute"]

    def command(self, unit: UnitAxes) -> FicsCommand[Any]:
        """The robot's command for it."""
        return self._built(_ABSOLUTE[self.coordinates], unit)


class RobotRelativeMoveRequest(
    _AxesMoveRequest, json_schema_extra=example(kind="relative", axes={"X": {"value": 10, "unit": "mm"}})
):
    """Move axes by an amount (C-HOST manual 2-5, 4-2)."""

    kind: Literal["relative"]

    def command(self, unit: UnitAxes) -> FicsCommand[Any]:
        """The robot's command for it."""
        return self._built(_RELATIVE[self.coordinates], unit)


class RobotPositionMoveRequest(StartRequest, json_schema_extra=example(kind="position", position=1)):
    """Move to a stored position (C-HOST manual 2-16)."""

    kind: Literal["position"]
    position: PositionNumber = Field(description="Number of the position, 1-1999; it has to be set.")
    speed_percent: SpeedPercent = None

    def command(self, _: UnitAxes) -> FicsCommand[Any]:
        """The robot's command for it."""
        return moves.MoveToPosition(position=self.position)


class RobotHomeRequest(StartRequest, json_schema_extra=example(kind="home")):
    """Home all axes, or the mechanism as its program does it (C-HOST manual 2-4)."""

    kind: Literal["home"]

    def command(self, _: UnitAxes) -> FicsCommand[Any]:
        """The robot's command for it."""
        return HomeRobot()


class RobotStepRequest(StartRequest, json_schema_extra=example(kind="step", axis="X", steps=10)):
    """Move one axis by a few of the smallest amounts it displays (C-HOST manual 2-3)."""

    kind: Literal["step"]
    axis: AxisName
    steps: Steps = Field(description="1-255 in either direction.")

    def command(self, _: UnitAxes) -> FicsCommand[Any]:
        """The robot's command for it."""
        return StepAxis(axis=self.axis, steps=self.steps)


RobotMoveRequest = Annotated[
    RobotAbsoluteMoveRequest
    | RobotRelativeMoveRequest
    | RobotPositionMoveRequest
    | RobotHomeRequest
    | RobotStepRequest,
    Field(discriminator="kind"),
]
