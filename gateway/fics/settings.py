"""A unit's settings by the names of its axes, its soft limits among them, which never cross (2-33)."""

from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any, Final, Literal, NamedTuple

from pydantic import Field

from gateway.core.errors import ControllerRefused, GatewayError, InvalidRequest
from gateway.core.operation import Expectation, Rows
from gateway.core.records import AnswerModel, SentBack, example
from gateway.core.rights import Right
from gateway.fics.amounts import Amounts, AxisSpeeds, AxisValue, ByAxis, build, in_order, numbers
from gateway.fics.axes import NOISE_DIGITS, AskedUnit, CoordinateSystem, Places, UnitAxes
from gateway.fics.errors import NotReadBack, PartlyChanged, RobotFailed
from gateway.texts import Text, text
from protocols.fics import homing, motor_axes, soft_limits, speeds
from protocols.fics.axis_settings import CoordinateSetting
from protocols.fics.homing import TYPES, TypeNumber
from protocols.fics.jog import StartJog, StepAxis, StopJog
from protocols.fics.motor_axes import (
    GetMotorLowerSoftLimits,
    GetMotorUpperSoftLimits,
    SetMotorLowerSoftLimits,
    SetMotorUpperSoftLimits,
)
from protocols.fics.notation import FourDigits, Milliseconds, PercentNumber, Quantity
from protocols.fics.row import FicsCommand
from protocols.fics.soft_limits import (
    GetLowerSoftLimits,
    GetUpperSoftLimits,
    SetLowerSoftLimits,
    SetUpperSoftLimits,
)

Row = type[FicsCommand[Any]]


class _Limits(NamedTuple):
    coordinates: CoordinateSystem
    get_lower: Row
    get_upper: Row
    set_lower: type[CoordinateSetting]
    set_upper: type[CoordinateSetting]


_LIMITS: Final = (
    _Limits("user", GetLowerSoftLimits, GetUpperSoftLimits, SetLowerSoftLimits, SetUpperSoftLimits),
    _Limits(
        "motor",
        GetMotorLowerSoftLimits,
        GetMotorUpperSoftLimits,
        SetMotorLowerSoftLimits,
        SetMotorUpperSoftLimits,
    ),
)


BEYOND: Final = "E07"
"""The refusal of a target beyond a soft limit, of any axis (C-HOST manual 2-12)."""


class CrossedAxisLimit(NamedTuple):
    """A soft limit of an axis that a place lies beyond, in the unit of the axis."""

    axis: str
    side: Literal["upper", "lower"]
    limit: float
    place: float
    unit: str

    @property
    def said(self) -> Text:
        """Say so: in English as a clause, in Japanese as a sentence."""
        place, limit = self._shown(self.place), self._shown(self.limit)
        return text(f"phrases.axis-beyond-{self.side}", axis=self.axis, place=place, limit=limit)

    def _shown(self, place: float) -> str:
        return f"{round(place, NOISE_DIGITS):.15g} {self.unit}"


async def crossed_limits(
    unit: AskedUnit, coordinates: CoordinateSystem, end: Places
) -> list[CrossedAxisLimit]:
    """Give the soft limits that the end of a move lies beyond; such a move is refused (C-HOST manual 2-12).

    An axis whose place is not known has none: a robot cannot hold it to them either, an assumption.

    :raises GatewayError: the limits were not read.
    """
    ends = {axis: round(place, NOISE_DIGITS) for axis, place in end.items() if place is not None}
    if not ends:
        return []
    limits = next(limit for limit in _LIMITS if limit.coordinates == coordinates)
    lower, upper = [await _limits_read(unit, limits, row) for row in (limits.get_lower, limits.get_upper)]
    units = unit.counted_in(coordinates)
    above = [
        CrossedAxisLimit(axis, "upper", upper[axis], at, units[axis])
        for axis, at in ends.items()
        if at > upper[axis]
    ]
    below = [
        CrossedAxisLimit(axis, "lower", lower[axis], at, units[axis])
        for axis, at in ends.items()
        if at < lower[axis]
    ]
    return sorted(above + below, key=lambda limit: list(ends).index(limit.axis))


async def name_limits(
    unit: AskedUnit, coordinates: CoordinateSystem, end: Places | None, refusal: GatewayError
) -> None:
    """Name the axes, their targets and the limits, where a refused move leads beyond; only reads are sent."""
    if not isinstance(refusal, ControllerRefused) or refusal.error_code != BEYOND or not end:
        return
    try:
        crossed = await crossed_limits(unit, coordinates, end)
    except GatewayError:
        return  # the refusal stands, with the manual's words
    if not crossed:
        return
    said = [limit.said for limit in crossed]
    beyond = Text(", and ".join(sentence.en for sentence in said), "".join(sentence.ja for sentence in said))
    refusal.reword("robot.beyond-limits", unit=unit.address, code=refusal.command_code, beyond=beyond)


async def uncrossed(unit: AskedUnit, changes: Mapping[str, FicsCommand[Any]]) -> list[FicsCommand[Any]]:
    """Put changes, given with their fields, into an order in which no limits cross on the way.

    :raises InvalidRequest: in the end an upper limit would be below the lower one.
    :raises GatewayError: the present limits could not be read.
    """
    ordered = list(changes.values())
    for limits in _LIMITS:
        concerned = {
            field: change
            for field, change in changes.items()
            if isinstance(change, limits.set_lower | limits.set_upper)
        }
        if concerned:
            ordered = [change for change in ordered if change not in concerned.values()]
            ordered += await _sequence(unit, limits, concerned)
    return ordered


async def _sequence(
    unit: AskedUnit, limits: _Limits, changes: Mapping[str, FicsCommand[Any]]
) -> list[FicsCommand[Any]]:
    """Raise upper limits first, then set the lower ones, then let the other upper ones come down."""
    lower, upper = [await _limits_read(unit, limits, row) for row in (limits.get_lower, limits.get_upper)]
    names = unit.names(limits.coordinates)
    new_lower, new_upper = [_given(names, changes, row) for row in (limits.set_lower, limits.set_upper)]
    for axis in names:
        low, high = (lower | new_lower)[axis], (upper | new_upper)[axis]
        if high < low:
            raise InvalidRequest(
                f"{', '.join(changes)}: axis {axis} of {unit.address} would have soft limits from {low:g} to "
                f"{high:g}; nothing was changed."
            )
    early = {axis: value for axis, value in new_upper.items() if value >= lower[axis]}
    late = {axis: value for axis, value in new_upper.items() if axis not in early}
    steps = ((limits.set_upper, early), (limits.set_lower, new_lower), (limits.set_upper, late))
    return [row(coordinates=[values.get(name) for name in names]) for row, values in steps if values]


async def _limits_read(unit: AskedUnit, limits: _Limits, row: Row) -> dict[str, float]:
    reply = await unit.read(row())
    return unit.by_axis(unit.names(limits.coordinates), reply.coordinates)


def _given(
    names: list[str], changes: Mapping[str, FicsCommand[Any]], row: type[CoordinateSetting]
) -> dict[str, float]:
    coordinates = next((change.coordinates for change in changes.values() if isinstance(change, row)), [])
    named = zip(names, coordinates, strict=False)
    return {axis: value for axis, value in named if value is not None}


ROWS: Final = Rows("robot settings")


class AxisSettingRows(NamedTuple):
    """A setting of the axes: the rows that read and write it, and whose axes it has."""

    read: Row
    write: Row
    coordinates: CoordinateSystem
    quantity: Quantity | None = None
    """The quantity in the units of the axes; None where all axes have the same unit."""

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
"""The settings by the name that clients use, in the order in which they are read and written."""

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


class UnitSettings(AnswerModel):
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


async def read(unit: AskedUnit, names: Iterable[str] = (SMOOTH, *SETTINGS)) -> UnitSettings:
    """Ask the robot for settings of a unit, one by one.

    :raises GatewayError: one could not be read.
    """
    found = {name: await _value(unit, name) for name in names}
    return UnitSettings(robot_id=unit.robot_id, unit=unit.number, **found)


async def change(
    unit: AskedUnit, wanted: SettingsChange, expects: Callable[[UnitSettings], None] | None = None
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


async def commands(unit: AskedUnit, wanted: SettingsChange) -> list[FicsCommand[Any]]:
    """The commands that change settings, in an order in which no soft limits cross.

    :raises InvalidRequest: none is named, or one cannot be.
    :raises GatewayError: the present soft limits could not be read.
    """
    changes = {name: _command(unit, name, value) for name, value in wanted if value is not None}
    if not changes:
        raise InvalidRequest("No setting is named; nothing was sent.")
    return await uncrossed(unit, changes)


async def _send_all(unit: AskedUnit, changes: list[FicsCommand[Any]], since: int | None) -> None:
    for done, change in enumerate(changes):
        try:
            await unit.change(change, since=None if done else since)
        except GatewayError as error:
            changed = ", ".join(earlier.wire_name() for earlier in changes[:done]) or "nothing"
            changed = f"Of the settings asked for, {changed} was changed"
            if done and not isinstance(error, ControllerRefused | RobotFailed):
                raise PartlyChanged(changed, error) from error
            error.detail += f" {changed} before it."
            raise


def _command(unit: AskedUnit, name: str, value: Any) -> FicsCommand[Any]:
    if name == SMOOTH:
        return speeds.SetSmoothAcceleration(enabled=int(value))
    setting = SETTINGS[name]
    names = unit.names(setting.coordinates)
    bare = in_order if setting.quantity is None else numbers
    return build(name, setting.write, **{setting.field: bare(name, unit, names, value)})


async def _value(unit: AskedUnit, name: str) -> Any:
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
async def get_settings(axes: AskedUnit) -> UnitSettings:
    """Ask the robot for all settings of a unit, one by one; refused while it moves."""
    return await read(axes)


@ROWS.patch("/robots/{robot_id}/units/{unit}/settings", Right.SETUP)
async def change_settings(
    axes: AskedUnit, wanted: SettingsChange, *, expects: Expectation | None
) -> UnitSettings:
    """Change settings of a unit and read them back; refused while it moves.

    All are checked before the first is sent. They are sent one by one, each read back before the next; where
    the robot refuses one, or tells another value afterwards, the problem tells which were changed before it.
    With `If-Match` all settings are read before, and nothing is sent where they are otherwise than they were.
    """
    return await change(axes, wanted, expects)


_WRITTEN_BY: Final[Mapping[Row, AxisSettingRows]] = {setting.write: setting for setting in SETTINGS.values()}


def require_fit(unit: UnitAxes, command: FicsCommand[Any]) -> None:
    """Refuse what the unit cannot take, whatever its state; coordinates of moves are looked at with the move.

    :raises InvalidRequest: more values than axes, no such axis, or a fraction of a pulse.
    """
    if isinstance(command, StartJog | StepAxis | StopJog):
        unit.require_axis(command.axis)
    if setting := _WRITTEN_BY.get(type(command)):
        values = getattr(command, setting.field)
        unit.require_values(setting.coordinates, values, setting.quantity, setting.field)
