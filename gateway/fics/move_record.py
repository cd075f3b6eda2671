"""The record of a robot's move, and which commands start one."""

from typing import Any, Final, Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from gateway.core.errors import InvalidRequest
from gateway.core.marks import DETAIL
from gateway.core.move_record import MoveRecord
from gateway.fics.axes import AxisUnits, AxisValues, CoordinateSystem, UnitAxes
from protocols.fics.homing import HomeRobot
from protocols.fics.jog import StepAxis
from protocols.fics.macros import RunMacro
from protocols.fics.motor_axes import MoveMotorsAbsolute, MoveMotorsRelative
from protocols.fics.moves import AxesMove, MoveAbsolute, MoveRelative, MoveToPosition
from protocols.fics.row import FicsCommand

RobotMoveKind = TypeAliasType(
    "RobotMoveKind", Literal["absolute", "relative", "position", "home", "step", "macro"]
)
RobotMoveCompletion = TypeAliasType("RobotMoveCompletion", Literal["reply", "inferred"])

KINDS: Final[dict[type[FicsCommand[Any]], RobotMoveKind]] = {
    MoveAbsolute: "absolute",
    MoveMotorsAbsolute: "absolute",
    MoveRelative: "relative",
    MoveMotorsRelative: "relative",
    MoveToPosition: "position",
    HomeRobot: "home",
    StepAxis: "step",
    RunMacro: "macro",
}
"""The kind of move that each command starts."""


class RobotMove(MoveRecord):
    """One move of one unit; positions are in the units of the axes."""

    robot_id: str
    unit: int
    kind: RobotMoveKind
    coordinates: CoordinateSystem = Field(description="Coordinates of the positions.")
    units: AxisUnits = Field(description="Units of the positions, by axis: mm, pulse or degree.")
    end_cause: str | None = Field(
        default=None,
        description="normal, stop_command or error_nnn as the robot says; not_executed, power_cycled or "
        "position_mismatch as the gateway found.",
    )
    start_position: AxisValues | None = Field(default=None, description="Position before the move, by axis.")
    target_position: AxisValues | None = Field(
        default=None, description="Target by axis, where it can be known beforehand."
    )
    longest_s: float | None = Field(
        default=None, description="Seconds it may take by distance and speed, where these are known."
    )
    position: AxisValues | None = Field(
        default=None, description="Position as last read, by axis; null while an axis does not know it."
    )
    completion: RobotMoveCompletion | None = Field(
        default=None,
        description="Evidence of the end: the robot's reply to the move, or inferred from its standstill.",
        json_schema_extra=DETAIL,
    )


def check(unit: UnitAxes, command: FicsCommand[Any]) -> None:
    """Refuse what the unit cannot do whatever its state.

    :raises InvalidRequest: no move, more axes than there are, no such axis, or a fraction of a pulse.
    """
    if type(command) not in KINDS:
        raise InvalidRequest(f"{command.wire_name()} starts no move; nothing was sent.")
    if isinstance(command, StepAxis):
        unit.require_axis(command.axis)
    if isinstance(command, AxesMove):
        unit.require_values(unit.coordinates_of(command), command.coordinates)
