"""Robots and their units over HTTP: what they are, where they stand, in which state, what is wrong."""

from datetime import datetime
from typing import Annotated, Literal

from fastapi import Query, Request, Response
from pydantic import BaseModel, Field

from api.common.requests import is_seen, json_response, new_router, origin, plant_of
from api.common.results import StopResult
from api.robots.names import RobotId, UnitNumber, robot_of, unit_of
from api.stops import StopBody, perform_stop
from gateway.core.line_state import LineState
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.times import age_ms_of, utc_of
from gateway.fics.axes import Coordinates
from gateway.fics.family import Fics
from gateway.fics.robot import Robot
from gateway.fics.system_errors import RobotErrorRecord
from gateway.fics.units import RobotUnit, UnknownReason
from gateway.operations import robots
from gateway.operations.commands import do
from protocols.fics.alarms import TakeCurrentError
from protocols.fics.notation import Quantity, driver_error_text
from protocols.fics.status import AxisSensors, AxisStatus, MotionMode

router = new_router("robots")

Fresh = Annotated[bool, Query(description="Ask the robot first.")]

Motion = Literal["standing", "jog", "move", "homing", "macro", "stopped"]
_MOTIONS: dict[int, Motion] = {
    MotionMode.STANDING: "standing",
    MotionMode.JOG: "jog",
    MotionMode.MOVE: "move",
    MotionMode.HOMING: "homing",
    MotionMode.MACRO: "macro",
    MotionMode.STOPPED: "stopped",
}


class AxisInfo(BaseModel):
    """An axis as it is configured."""

    name: str
    unit: str = Field(description="Of its coordinates: mm, pulse or degree.")
    speed_unit: str


class UnitInfo(BaseModel):
    """A unit of a robot as the gateway knows it, without asking it."""

    robot_id: str
    number: int
    axes: list[AxisInfo] = Field(description="User axes, in the robot's order.")
    motor_axes: list[AxisInfo] = Field(description="Motor axes; the same ones where nothing is converted.")
    homed: Literal["yes", "unknown"] = Field(
        description="yes: every axis has told its place when the unit was read last, and no homing, macro or "
        "loss of power is known since. Another unit is not selected just to ask it."
    )
    move_id: str | None = Field(description="The move that is not over yet.")


class RobotInfo(BaseModel):
    """A robot as the gateway knows it, without asking it."""

    robot_id: str
    line_id: str
    line_state: LineState
    down_reason: str | None = Field(description="Why the line's port is not open; null while it is.")
    name: str
    online: bool = Field(description="Whether it can be asked now, as far as is known.")
    mode: int = Field(description="Its communication mode: 3, or 2, in which ends are found by polling.")
    moving: bool | None = Field(
        description="Null while out of reach or after a move whose end nobody saw, until it is looked at."
    )
    power_cycled: bool = Field(description="It has lost its power; motion is refused until acknowledged.")
    error: RobotErrorRecord | None = Field(description="The error that stands, as far as is known.")
    bit_mismatches: list[str] = Field(
        description="What its units showed when they stood still, homed, that status_bits and sensor_bits of "
        "the configuration do not explain."
    )
    missing_units: list[int] = Field(
        description="Units of the configuration that the robot says it does not have."
    )
    units: list[UnitInfo]


class ModeChange(RequestModel, json_schema_extra=example(mode=3)):
    """The mode a robot is to be in."""

    mode: Literal[2, 3] = Field(description="3; or 2, in which most commands are silent.")


class RobotList(BaseModel):
    """All robots of the configuration."""

    robots: list[RobotInfo]


class AxisPlace(BaseModel):
    """Where an axis stands."""

    value: float | None = Field(description="Null while the robot does not know it.")
    unit: str = Field(description="mm, pulse or degree.")
    reason: UnknownReason | None = Field(
        description="Why it is not known: not homed, homing or a macro or automatic operation under way, no "
        "user coordinates where the motors stand, or not to be found out."
    )


class UnitPosition(BaseModel):
    """Where the axes of a unit stand."""

    robot_id: str
    unit: int
    coordinates: Coordinates
    axes: dict[str, AxisPlace]
    read_at: datetime = Field(description="When the robot's answer came.")
    age_ms: float = Field(description="How old the answer was when it was passed on.")


class AxisState(BaseModel):
    """How a motor axis is (C-HOST manual 2-10, 2-11)."""

    motion: Motion = Field(description="stopped: by the stop input or an immediate stop.")
    origin_done: bool
    servo_ready: bool
    moving: bool
    alarm: bool
    driver_error: str = Field(
        description="The driver's own code, hexadecimal as in `31h`; `00h` when it has none."
    )
    sensors: AxisSensors


class UnitStatus(BaseModel):
    """How a unit is."""

    robot_id: str
    unit: int
    moving: bool = Field(description="Whether an axis moves, or a macro, homing or a move is under way.")
    axes: dict[str, AxisState] = Field(description="By motor axis.")
    read_at: datetime = Field(description="When the answer to ACD came, the first of the two.")
    age_ms: float


class RobotErrors(BaseModel):
    """The errors of a robot that stand."""

    robot_id: str
    errors: list[RobotErrorRecord]
    looked_at: datetime | None = Field(
        description="When the robot has last told which error stands; null while it never has."
    )


@router.get("/robots", Right.VIEW, any_scope=True, response_model=RobotList)
async def list_robots(request: Request) -> Response:
    """List all robots; nothing is sent."""
    all_robots = plant_of(request).family(Fics).robots()
    seen = [_info(robot) for robot in all_robots if is_seen(request, robot.id)]
    return json_response(RobotList(robots=seen))


@router.get("/robots/{robot_id}", Right.VIEW, response_model=RobotInfo)
async def get_robot(request: Request, robot_id: RobotId) -> Response:
    """Tell what is known of a robot; nothing is sent."""
    return json_response(_info(robot_of(request, robot_id)))


@router.get("/robots/{robot_id}/units/{unit}", Right.VIEW, response_model=UnitInfo)
async def get_unit(request: Request, robot_id: RobotId, unit: UnitNumber) -> Response:
    """Tell what is known of a unit; nothing is sent."""
    return json_response(_unit_info(robot_of(request, robot_id), unit_of(request, robot_id, unit)))


@router.get("/robots/{robot_id}/units/{unit}/position", Right.VIEW, response_model=UnitPosition)
async def get_unit_position(
    request: Request, robot_id: RobotId, unit: UnitNumber, coordinates: Coordinates = "user"
) -> Response:
    """Ask the robot where the unit stands, in user (APS) or motor coordinates (MPS)."""
    axes = unit_of(request, robot_id, unit)
    places, reasons, at = await robots.position(plant_of(request), origin(), robot_id, unit, coordinates)
    return json_response(
        UnitPosition(
            robot_id=robot_id,
            unit=unit,
            coordinates=coordinates,
            axes={
                name: AxisPlace(
                    value=place,
                    unit=axes.systems[name].unit(Quantity.POSITION),
                    reason=reasons.get(name),
                )
                for name, place in places.items()
            },
            read_at=utc_of(at),
            age_ms=age_ms_of(at),
        )
    )


@router.get("/robots/{robot_id}/units/{unit}/status", Right.VIEW, response_model=UnitStatus)
async def get_unit_status(request: Request, robot_id: RobotId, unit: UnitNumber) -> Response:
    """Ask the robot how the unit's motor axes are (ACD) and for their sensors (ASD)."""
    found = await robots.status(plant_of(request), origin(), robot_id, unit)
    return json_response(
        UnitStatus(
            robot_id=robot_id,
            unit=unit,
            moving=found.moving,
            axes={name: _state(status, found.sensors[name]) for name, status in found.axes.items()},
            read_at=utc_of(found.at),
            age_ms=age_ms_of(found.at),
        )
    )


@router.get("/robots/{robot_id}/errors", Right.VIEW, response_model=RobotErrors)
async def list_robot_errors(request: Request, robot_id: RobotId, fresh: Fresh = False) -> Response:
    """Tell which errors stand, as the gateway has read them; with `fresh` the robot is asked (ERR).

    An error of the system is not cleared by that.
    """
    if fresh:
        await do(plant_of(request), origin(), f"/robots/{robot_id}", TakeCurrentError())
    return json_response(_errors(robot_of(request, robot_id)))


@router.post("/robots/{robot_id}/errors/reset", Right.OPERATE, response_model=RobotErrors)
async def reset_robot_errors(request: Request, robot_id: RobotId) -> Response:
    """Reset the errors and the state EMERGENCY (DRT), and tell what still stands. Nothing moves."""
    await robots.reset_errors(plant_of(request), origin(), robot_id)
    return json_response(_errors(robot_of(request, robot_id)))


@router.put("/robots/{robot_id}/mode", Right.SETUP, response_model=RobotInfo)
async def change_robot_mode(request: Request, robot_id: RobotId, wanted: ModeChange) -> Response:
    """Bring the robot into another mode (MOD) until the gateway ends; refused while it moves."""
    await robots.change_mode(plant_of(request), origin(), robot_id, wanted.mode)
    return json_response(_info(robot_of(request, robot_id)))


@router.post("/robots/{robot_id}/power-cycle/acknowledge", Right.OPERATE, response_model=RobotInfo)
async def acknowledge_power_cycle(request: Request, robot_id: RobotId) -> Response:
    """Allow motion again after a loss of power, once the speeds are set: they are at 100 % since then."""
    await robots.acknowledge_power_cycle(plant_of(request), origin(), robot_id)
    return json_response(_info(robot_of(request, robot_id)))


@router.post("/robots/{robot_id}/stop", Right.STOP, response_model=StopResult)
async def stop_robot(request: Request, robot_id: RobotId, stop: StopBody) -> Response:
    """Stop all axes of a robot by software: what waits is cancelled, and the stop goes out first."""
    return await perform_stop(request, f"/robots/{robot_id}", stop)


@router.post("/robots/{robot_id}/units/{unit}/stop", Right.STOP, response_model=StopResult)
async def stop_unit(request: Request, robot_id: RobotId, unit: UnitNumber, stop: StopBody) -> Response:
    """Stop all axes of the unit's robot by software: it knows no stop of a single unit."""
    return await perform_stop(request, f"/robots/{robot_id}/units/{unit}", stop)


def _errors(robot: Robot) -> RobotErrors:
    standing = robot.latched_error
    return RobotErrors(
        robot_id=robot.id,
        errors=[] if standing is None else [standing],
        looked_at=robot.errors.looked_at,
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
        bit_mismatches=list(robot.bits.mismatches.values()),
        missing_units=sorted(robot.selection.missing),
        units=[_unit_info(robot, unit) for unit in robot.units],
    )


def _unit_info(robot: Robot, unit: RobotUnit) -> UnitInfo:
    return UnitInfo(
        robot_id=unit.robot_id,
        number=unit.number,
        axes=_axes(unit, unit.axes),
        motor_axes=_axes(unit, unit.motor_axes),
        homed="yes" if robot.power.origins.are_complete(unit) else "unknown",
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
