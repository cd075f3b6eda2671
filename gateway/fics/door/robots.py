"""Robots and their units: what they are, where they stand, in which state, and what is wrong."""

from datetime import datetime
from typing import Annotated, Final, Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from gateway.core.line_state import LineState
from gateway.core.marks import DETAIL
from gateway.core.operation import Rows
from gateway.core.records import AnswerModel, RequestModel, example
from gateway.core.rights import Right
from gateway.core.targets import Target
from gateway.core.times import age_ms_of, utc_of
from gateway.door.caller import sees
from gateway.fics.axes import CoordinateSystem, UnitNumber, at_rest
from gateway.fics.robot import Robot, Robots
from gateway.fics.system_errors import RobotErrorRecord
from gateway.fics.units import RobotUnit, UnknownReason
from gateway.plant import Plant
from gateway.security import entries
from protocols.fics.alarms import ResetErrors, TakeCurrentError
from protocols.fics.notation import Quantity, driver_error_text
from protocols.fics.status import AxisSensors, AxisStatus, MotionMode

ROWS: Final = Rows("robots")

Fresh = Annotated[bool, Field(description="Ask the robot first.")]

AxisMotion = TypeAliasType("AxisMotion", Literal["standing", "jog", "move", "homing", "macro", "stopped"])
_MOTIONS: dict[int, AxisMotion] = {
    MotionMode.STANDING: "standing",
    MotionMode.JOG: "jog",
    MotionMode.MOVE: "move",
    MotionMode.HOMING: "homing",
    MotionMode.MACRO: "macro",
    MotionMode.STOPPED: "stopped",
}


class AxisInfo(AnswerModel):
    """An axis as it is configured."""

    name: str
    unit: str = Field(description="Unit of its coordinates: mm, pulse or degree.")
    speed_unit: str


UnitHomed = TypeAliasType("UnitHomed", Literal["yes", "unknown"])


class UnitInfo(AnswerModel):
    """A unit of a robot as the gateway knows it, without asking it."""

    robot_id: str
    number: int
    axes: list[AxisInfo] = Field(description="User axes, in the robot's order.")
    motor_axes: list[AxisInfo] = Field(description="Motor axes; the same ones where nothing is converted.")
    homed: UnitHomed = Field(
        description="yes: every axis has told its place when the unit was read last, and no homing, macro or "
        "loss of power is known since. Another unit is not selected just to ask it."
    )
    move_id: str | None = Field(description="The move that is not over yet.")


class RobotInfo(AnswerModel):
    """A robot as the gateway knows it, without asking it."""

    robot_id: str
    line_id: str
    line_state: LineState
    down_reason: str | None = Field(description="Why the line's port is not open; null while it is.")
    name: str
    online: bool = Field(description="True if it can be asked now, as far as is known.")
    mode: int = Field(description="Communication mode: 3, or 2, in which ends are found by polling.")
    moving: bool | None = Field(
        description=(
            "True if an axis moves; null while out of reach, or until it is looked at after a move with an "
            "unseen end."
        )
    )
    power_cycled: bool = Field(
        description="True if it has lost its power; motion is refused until that is acknowledged."
    )
    error: RobotErrorRecord | None = Field(description="The error that stands, as far as is known.")
    bit_mismatches: list[str] = Field(
        description=(
            "Bits of units that stood still, homed, which status_bits and sensor_bits of the configuration "
            "do not explain."
        )
    )
    missing_units: list[int] = Field(
        description="Units of the configuration that the robot says it does not have."
    )
    units: list[UnitInfo]


HostMode = TypeAliasType("HostMode", Literal[2, 3])


class ModeChange(RequestModel, json_schema_extra=example(mode=3)):
    """The mode a robot is to be in."""

    mode: HostMode = Field(description="3; or 2, in which most commands are silent.")


class RobotList(AnswerModel):
    """All robots of the configuration."""

    robots: list[RobotInfo]


class AxisPlace(AnswerModel):
    """Where an axis stands."""

    value: float | None = Field(description="Coordinate; null while the robot does not know it.")
    unit: str = Field(description="mm, pulse or degree.")
    reason: UnknownReason | None = Field(
        description="Why it is not known: not homed, homing or a macro or automatic operation under way, no "
        "user coordinates where the motors stand, or not to be found out."
    )


class UnitPosition(AnswerModel):
    """Where the axes of a unit stand."""

    robot_id: str
    unit: int
    coordinates: CoordinateSystem
    axes: dict[str, AxisPlace]
    read_at: datetime = Field(description="Time of the robot's answer.")
    age_ms: float = Field(description="Age of the answer in ms when it was passed on.")


class AxisState(AnswerModel):
    """How a motor axis is (C-HOST manual 2-10, 2-11)."""

    motion: AxisMotion = Field(description="stopped: by the stop input or an immediate stop.")
    origin_done: bool
    servo_ready: bool
    moving: bool
    alarm: bool
    driver_error: str = Field(
        description="The driver's own code, hexadecimal as in `31h`; `00h` when it has none."
    )
    sensors: AxisSensors = Field(json_schema_extra=DETAIL)


class UnitStatus(AnswerModel):
    """The state of a unit and its axes."""

    robot_id: str
    unit: int
    moving: bool = Field(description="True if an axis moves, or a macro, homing or a move is under way.")
    axes: dict[str, AxisState] = Field(description="States of the motor axes, by name.")
    read_at: datetime
    age_ms: float


class RobotErrors(AnswerModel):
    """The errors of a robot that stand."""

    robot_id: str
    errors: list[RobotErrorRecord]
    looked_at: datetime | None = Field(
        description="Time at which the robot last told its present error; null while it never has."
    )


@ROWS.get("/robots", any_scope=True)
async def list_robots(plant: Plant) -> RobotList:
    """List all robots; nothing is sent."""
    seen = (robot for robot in plant.family(Robots).robots() if sees(plant.access, robot.id))
    return RobotList(robots=[_info(robot) for robot in seen])


@ROWS.get("/robots/{robot_id}")
async def get_robot(robot: Robot) -> RobotInfo:
    """Tell what is known of a robot; nothing is sent."""
    return _info(robot)


@ROWS.get("/robots/{robot_id}/units/{unit}")
async def get_unit(robot: Robot, unit: UnitNumber) -> UnitInfo:
    """Tell what is known of a unit; nothing is sent."""
    return _unit_info(robot, robot.unit(unit))


@ROWS.get("/robots/{robot_id}/units/{unit}/position")
async def get_unit_position(axes: RobotUnit, *, coordinates: CoordinateSystem = "user") -> UnitPosition:
    """Ask the robot where the unit stands, in user (APS) or motor coordinates (MPS)."""
    places, at = await axes.position_at(coordinates)
    reasons = await axes.why_unknown(places)
    return UnitPosition(
        robot_id=axes.robot_id,
        unit=axes.number,
        coordinates=coordinates,
        axes={
            name: AxisPlace(
                value=place, unit=axes.systems[name].unit(Quantity.POSITION), reason=reasons.get(name)
            )
            for name, place in places.items()
        },
        read_at=utc_of(at),
        age_ms=age_ms_of(at),
    )


@ROWS.get("/robots/{robot_id}/units/{unit}/status")
async def get_unit_status(axes: RobotUnit) -> UnitStatus:
    """Ask the robot how the unit's motor axes are (ACD) and for their sensors (ASD)."""
    statuses, at = await axes.status_at()
    sensors = await axes.sensors()
    return UnitStatus(
        robot_id=axes.robot_id,
        unit=axes.number,
        moving=not at_rest(statuses.values()),
        axes={name: _state(status, sensors[name]) for name, status in statuses.items()},
        read_at=utc_of(at),
        age_ms=age_ms_of(at),
    )


@ROWS.get("/robots/{robot_id}/errors")
async def list_robot_errors(robot: Robot, target: Target, *, fresh: Fresh = False) -> RobotErrors:
    """Tell which errors stand, as the gateway has read them; with `fresh` the robot is asked (ERR).

    An error of the system is not cleared by that.
    """
    if fresh:
        await target.ask(TakeCurrentError())
    return _errors(robot)


@ROWS.post("/robots/{robot_id}/errors/reset", Right.OPERATE)
async def reset_robot_errors(robot: Robot, target: Target) -> RobotErrors:
    """Reset the errors and the state EMERGENCY (DRT), and tell what still stands. Nothing moves."""
    await target.ask(ResetErrors())
    return _errors(robot)


@ROWS.put("/robots/{robot_id}/mode", Right.SETUP, later=True)
async def change_robot_mode(robot: Robot, wanted: ModeChange) -> RobotInfo:
    """Bring the robot into another mode (MOD) until the gateway ends; refused while it moves."""
    await robot.change_mode(wanted.mode)
    return _info(robot)


@ROWS.post("/robots/{robot_id}/power-cycle/acknowledge", Right.OPERATE)
async def acknowledge_power_cycle(plant: Plant, robot: Robot) -> RobotInfo:
    """Allow motion again after a loss of power, once the speeds are set: they are at 100 % since then."""
    robot.known.power.acknowledge()
    plant.access.security.note(entries.POWER_CYCLE_ACKNOWLEDGED, robot.id)
    return _info(robot)


class MacroInfo(AnswerModel):
    """A macro by its name."""

    name: str
    title: str | None = Field(description="Title of the macro in the configuration; null without one.")
    refused: bool = Field(description="True if the robot refused it as unknown at the last call.")


class MacroList(AnswerModel):
    """The macros that are known: a robot cannot be asked for their names."""

    robot_id: str
    macros: list[MacroInfo]


@ROWS.get("/robots/{robot_id}/macros", later=True)
async def list_macros(robot: Robot) -> MacroList:
    """List the macros of the configuration, and those the robot has refused; nothing is sent."""
    macros = robot.macros
    listed = [
        MacroInfo(name=name, title=macros.titles.get(name), refused=name in macros.refused)
        for name in macros.names()
    ]
    return MacroList(robot_id=robot.id, macros=listed)


def _errors(robot: Robot) -> RobotErrors:
    standing = robot.latched_error
    return RobotErrors(
        robot_id=robot.id,
        errors=[] if standing is None else [standing],
        looked_at=robot.known.error.looked_at,
    )


def _info(robot: Robot) -> RobotInfo:
    line = robot.line
    return RobotInfo(
        robot_id=robot.id,
        line_id=line.id,
        line_state=line.state,
        down_reason=line.trouble,
        name=robot.name,
        online=robot.online,
        mode=robot.mode,
        moving=robot.moving,
        power_cycled=robot.power_cycled,
        error=robot.latched_error,
        bit_mismatches=list(robot.known.bits.mismatches.values()),
        missing_units=sorted(robot.known.unit.missing),
        units=[_unit_info(robot, unit) for unit in robot.units],
    )


def _unit_info(robot: Robot, unit: RobotUnit) -> UnitInfo:
    return UnitInfo(
        robot_id=unit.robot_id,
        number=unit.number,
        axes=_axes(unit, unit.axes),
        motor_axes=_axes(unit, unit.motor_axes),
        homed="yes" if robot.known.power.origins.are_complete(unit) else "unknown",
        move_id=unit.move.id if unit.move else None,
    )


def _axes(unit: RobotUnit, names: list[str]) -> list[AxisInfo]:
    systems = {name: unit.systems[name] for name in names}
    return [
        AxisInfo(name=name, unit=system.unit(Quantity.POSITION), speed_unit=system.unit(Quantity.SPEED))
        for name, system in systems.items()
    ]


def _state(status: AxisStatus, sensors: AxisSensors) -> AxisState:
    return AxisState(
        motion=_MOTIONS[status.motion_mode],
        origin_done=status.origin_done,
        servo_ready=status.servo_ready,
        moving=status.moving,
        alarm=status.alarm,
        driver_error=driver_error_text(status.driver_error),
        sensors=sensors,
    )
