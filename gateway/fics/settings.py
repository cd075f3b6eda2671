"""A unit's settings: all that can be read back, by the names of the axes."""

from collections.abc import Callable, Iterable
from typing import Annotated, Any, Final, NamedTuple

from pydantic import BaseModel, Field

from gateway.core.errors import ControllerRefused, GatewayError, InvalidRequest
from gateway.core.operation import Expectation, Rows
from gateway.core.records import SentBack, example
from gateway.core.rights import Right
from gateway.fics.amounts import Amounts, AxisSpeeds, AxisValue, ByAxis, build, in_order, numbers
from gateway.fics.axes import Coordinates
from gateway.fics.errors import NotReadBack, PartlyChanged, RobotFailed
from gateway.fics.soft_limits import uncrossed
from gateway.fics.units import RobotUnit
from protocols.fics import homing, motor_axes, soft_limits, speeds
from protocols.fics.homing import TYPES, TypeNumber
from protocols.fics.notation import FourDigits, Milliseconds, PercentNumber, Quantity
from protocols.fics.row import FicsCommand

ROWS: Final = Rows("robot settings")
Row = type[FicsCommand[Any]]


class AxisSettingRows(NamedTuple):
    """A setting of the axes: the rows that read and write it, and whose axes it has."""

    read: Row
    write: Row
    coordinates: Coordinates
    quantity: Quantity | None = None
    """What is measured in the units of the axes; None where all axes have the same unit."""

    @property
    def field(self) -> str:
        """The field of both rows that has the values."""
        return next(iter(self.write.model_fields))


PLACE, SPEED = Quantity.POSITION, Quantity.SPEED
SETTINGS: Final[dict[str, AxisSettingRows]] = {
    "speed_percent": AxisSettingRows(speeds.GetSpeedPercent, speeds.SetSpeedPercent, "user"),
    "maximum_speed": AxisSettingRows(speeds.GetMaximumSpeeds, speeds.SetMaximumSpeeds, "user", SPEED),
    "acceleration_time_ms": AxisSettingRows(speeds.GetAccelerationTimes, speeds.SetAccelerationTimes, "user"),
    "deceleration_time_ms": AxisSettingRows(speeds.GetDecelerationTimes, speeds.SetDecelerationTimes, "user"),
    "upper_soft_limit": AxisSettingRows(
        soft_limits.GetUpperSoftLimits, soft_limits.SetUpperSoftLimits, "user", PLACE
    ),
    "lower_soft_limit": AxisSettingRows(
        soft_limits.GetLowerSoftLimits, soft_limits.SetLowerSoftLimits, "user", PLACE
    ),
    "start_speed_pps": AxisSettingRows(speeds.GetSelfStartSpeeds, speeds.SetSelfStartSpeeds, "motor"),
    "homing_type": AxisSettingRows(homing.GetHomingTypes, homing.SetHomingTypes, "motor"),
    "homing_offset": AxisSettingRows(homing.GetHomingOffsets, homing.SetHomingOffsets, "motor", PLACE),
    "homing_speed": AxisSettingRows(homing.GetHomingSpeeds, homing.SetHomingSpeeds, "motor", SPEED),
    "index_search_speed": AxisSettingRows(
        homing.GetIndexSearchSpeeds, homing.SetIndexSearchSpeeds, "motor", SPEED
    ),
    "motor_speed_percent": AxisSettingRows(
        motor_axes.GetMotorSpeedPercent, motor_axes.SetMotorSpeedPercent, "motor"
    ),
    "motor_maximum_speed": AxisSettingRows(
        motor_axes.GetMotorMaximumSpeeds, motor_axes.SetMotorMaximumSpeeds, "motor", SPEED
    ),
    "motor_acceleration_time_ms": AxisSettingRows(
        motor_axes.GetMotorAccelerationTimes, motor_axes.SetMotorAccelerationTimes, "motor"
    ),
    "motor_deceleration_time_ms": AxisSettingRows(
        motor_axes.GetMotorDecelerationTimes, motor_axes.SetMotorDecelerationTimes, "motor"
    ),
    "motor_upper_soft_limit": AxisSettingRows(
        motor_axes.GetMotorUpperSoftLimits, motor_axes.SetMotorUpperSoftLimits, "motor", PLACE
    ),
    "motor_lower_soft_limit": AxisSettingRows(
        motor_axes.GetMotorLowerSoftLimits, motor_axes.SetMotorLowerSoftLimits, "motor", PLACE
    ),
}
"""By the name that clients use, in the order in which they are read and written."""

PERCENT = "Percent of the maximum speed, 0.1-100."
TIME = "In milliseconds, 1-9999."
START_SPEED = "In pulses per second, 0-9999."
Percents = Annotated[ByAxis[PercentNumber] | None, Field(description=PERCENT)]
Times = Annotated[ByAxis[Milliseconds] | None, Field(description=TIME)]


class SettingsChange(SentBack, json_schema_extra=example(speed_percent={"X": 50})):
    """Settings to change; what is not named stays as it is, and so do axes that are not named."""

    read_only = frozenset(("robot_id", "unit"))

    smooth_acceleration: bool | None = Field(default=None, description="S-curve; of all axes of the unit.")
    speed_percent: Percents = None
    maximum_speed: AxisSpeeds | None = None
    acceleration_time_ms: Times = None
    deceleration_time_ms: Times = None
    upper_soft_limit: Amounts | None = None
    lower_soft_limit: Amounts | None = None
    start_speed_pps: Annotated[ByAxis[FourDigits] | None, Field(description=START_SPEED)] = None
    homing_type: Annotated[ByAxis[TypeNumber] | None, Field(description=TYPES)] = None
    homing_offset: Amounts | None = None
    homing_speed: AxisSpeeds | None = None
    index_search_speed: AxisSpeeds | None = None
    motor_speed_percent: Percents = None
    motor_maximum_speed: AxisSpeeds | None = None
    motor_acceleration_time_ms: Times = None
    motor_deceleration_time_ms: Times = None
    motor_upper_soft_limit: Amounts | None = None
    motor_lower_soft_limit: Amounts | None = None


class UnitSettings(BaseModel):
    """The settings of a unit; after a change those that were changed, read back."""

    robot_id: str
    unit: int
    smooth_acceleration: bool | None = Field(default=None, description="S-curve; of all axes of the unit.")
    speed_percent: dict[str, float] | None = Field(default=None, description="100 after power-on.")
    maximum_speed: dict[str, AxisValue] | None = None
    acceleration_time_ms: dict[str, int] | None = None
    deceleration_time_ms: dict[str, int] | None = None
    upper_soft_limit: dict[str, AxisValue] | None = None
    lower_soft_limit: dict[str, AxisValue] | None = None
    start_speed_pps: dict[str, int] | None = None
    homing_type: Annotated[dict[str, int] | None, Field(description=TYPES)] = None
    homing_offset: dict[str, AxisValue] | None = None
    homing_speed: dict[str, AxisValue] | None = None
    index_search_speed: dict[str, AxisValue] | None = None
    motor_speed_percent: dict[str, float] | None = Field(default=None, description="100 after power-on.")
    motor_maximum_speed: dict[str, AxisValue] | None = None
    motor_acceleration_time_ms: dict[str, int] | None = None
    motor_deceleration_time_ms: dict[str, int] | None = None
    motor_upper_soft_limit: dict[str, AxisValue] | None = None
    motor_lower_soft_limit: dict[str, AxisValue] | None = None


SMOOTH = "smooth_acceleration"


async def read(unit: RobotUnit, names: Iterable[str] = (SMOOTH, *SETTINGS)) -> UnitSettings:
    """Ask the robot for settings of a unit, one by one.

    :raises GatewayError: one could not be read.
    """
    found = {name: await _value(unit, name) for name in names}
    return UnitSettings(robot_id=unit.robot_id, unit=unit.number, **found)


async def change(
    unit: RobotUnit, wanted: SettingsChange, expects: Callable[[UnitSettings], None] | None = None
) -> UnitSettings:
    """Change settings of a unit and read them back.

    All are checked before the first is sent. They are sent one by one, each read back before the next.
    `expects` refuses present settings that the sender does not know.

    :raises Outdated: they are otherwise than expected; nothing was sent.
    :raises InvalidRequest: none is named, or one cannot be; nothing was sent.
    :raises PartlyChanged: it was broken off; the error tells which were changed before.
    :raises NotReadBack: all were changed, and the robot has not told what they are now.
    :raises GatewayError: nothing was changed.
    """
    since = await unit.as_expected(lambda: read(unit), expects)
    await _send_all(unit, await commands(unit, wanted), since)
    try:
        return await read(unit, wanted.model_dump(exclude_none=True))
    except GatewayError as error:
        raise NotReadBack(f"The settings of {unit.address} were changed", error) from error


async def commands(unit: RobotUnit, wanted: SettingsChange) -> list[FicsCommand[Any]]:
    """The commands that change settings, in an order in which no soft limits cross.

    :raises InvalidRequest: none is named, or one cannot be.
    :raises GatewayError: the present soft limits could not be read.
    """
    changes = {name: _command(unit, name, value) for name, value in wanted if value is not None}
    if not changes:
        raise InvalidRequest("No setting is named; nothing was sent.")
    return await uncrossed(unit, changes)


async def _send_all(unit: RobotUnit, changes: list[FicsCommand[Any]], since: int | None) -> None:
    for done, change in enumerate(changes):
        try:
            await unit.change(change, None if done else since)
        except GatewayError as error:
            changed = ", ".join(earlier.wire_name() for earlier in changes[:done]) or "nothing"
            changed = f"Of the settings asked for, {changed} was changed"
            if done and not isinstance(error, ControllerRefused | RobotFailed):
                raise PartlyChanged(changed, error) from error
            error.detail += f" {changed} before it."
            raise


def _command(unit: RobotUnit, name: str, value: Any) -> FicsCommand[Any]:
    if name == SMOOTH:
        return speeds.SetSmoothAcceleration(enabled=int(value))
    setting = SETTINGS[name]
    names = unit.names(setting.coordinates)
    bare = in_order if setting.quantity is None else numbers
    return build(name, setting.write, **{setting.field: bare(name, unit, names, value)})


async def _value(unit: RobotUnit, name: str) -> Any:
    if name == SMOOTH:
        return bool((await unit.read(speeds.GetSmoothAcceleration())).enabled)
    setting = SETTINGS[name]
    reply = await unit.read(setting.read())
    values = unit.by_axis(unit.names(setting.coordinates), getattr(reply, setting.field))
    if setting.quantity is None:
        return values
    return {
        axis: AxisValue(value=value, unit=unit.systems[axis].unit(setting.quantity))
        for axis, value in values.items()
    }


@ROWS.get("/robots/{robot_id}/units/{unit}/settings", tagged=True)
async def get_settings(axes: RobotUnit) -> UnitSettings:
    """Ask the robot for all settings of a unit, one by one; refused while it moves."""
    return await read(axes)


@ROWS.patch("/robots/{robot_id}/units/{unit}/settings", Right.SETUP)
async def change_settings(
    axes: RobotUnit, wanted: SettingsChange, *, expects: Expectation | None
) -> UnitSettings:
    """Change settings of a unit and read them back; refused while it moves.

    All are checked before the first is sent. They are sent one by one, each read back before the next; where
    the robot refuses one, or tells another value afterwards, the problem tells which were changed before it.
    With `If-Match` all settings are read before, and nothing is sent where they are otherwise than they were.
    """
    return await change(axes, wanted, expects)
