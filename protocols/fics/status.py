"""Where the axes are and how they are (C-HOST manual 2-9 to 2-11)."""

from collections.abc import Sequence
from enum import IntEnum
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from protocols.fics.notation import DriverError, ListLength, MaybeCoordinates, PerAxis
from protocols.fics.row import Query
from protocols.table import Reply, Wire


class AxisCoordinates(Reply, args="{coordinates}"):
    """Positions of the axes."""

    coordinates: MaybeCoordinates = Field(
        description="Per axis, in mm, pulse or degree as it is set up; null where the position is not known: "
        "not homed, no connection, automatic operation, homing or a macro under way, or no conversion. "
        "May be a single null for all axes."
    )


class GetUserPosition(
    Query[AxisCoordinates], code="APS", example=("APS", "APS 12.5,-3,#####", "APS", "APS #####")
):
    """現在位置要求: get the present position of the unit."""


class MotionMode(IntEnum):
    """The present motion of an axis (C-HOST manual 2-10)."""

    STANDING = 0
    JOG = 1
    MOVE = 2
    HOMING = 3
    MACRO = 4
    STOPPED = 5
    """The stop input of the system is active, or AES was received."""


class AxisStatus(BaseModel):
    """The state of a motor axis."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid")

    motion_mode: Annotated[int, Field(ge=0, le=5)] = Field(
        description="0 standing, 1 JOG, 2 move, 3 homing, 4 macro, 5 stopped by the stop input or AES."
    )
    origin_done: bool
    servo_ready: bool
    moving: bool
    alarm: bool
    driver_error: DriverError = Field(
        description="The driver's own code, hexadecimal as in `31h`; `00h` when it has none."
    )


# The figure that names the bits of the second digit is lost: their order is an assumption.
STATUS_BITS = ("origin_done", "servo_ready", "moving", "alarm")


class AxisStatusWire(Wire):
    """Four hexadecimal digits: motion mode, bits, and two of the driver's error code."""

    pattern = "[0-5][0-9A-F]{3}"

    def encode(self, value: Any) -> str:
        """Write the digits."""
        bits = sum(getattr(value, name) << place for place, name in enumerate(STATUS_BITS))
        return f"{value.motion_mode:X}{bits:X}{value.driver_error:02X}"

    def decode(self, text: str) -> AxisStatus:
        """Read the digits."""
        mode, bits, driver_error = int(text[0]), int(text[1], 16), int(text[2:4], 16)
        flags = {name: bool(bits >> place & 1) for place, name in enumerate(STATUS_BITS)}
        return AxisStatus(motion_mode=mode, driver_error=driver_error, **flags)


class AxisStatuses(Reply, args="{axes}"):
    """The status of each motor axis of the unit."""

    axes: Annotated[list[AxisStatus], ListLength, PerAxis(AxisStatusWire(), hole=None)]


class GetAxisStatus(Query[AxisStatuses], code="ACD", example=("ACD", "ACD 2700,0300,0B41")):
    """軸ステータス問い合わせ: get the status of the unit's motor axes; clears no error."""


class AxisSensors(BaseModel):
    """The sensors of a motor axis."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid")

    origin: bool
    plus_limit: bool
    minus_limit: bool


# The figure that names the bits is lost: their order is an assumption.
SENSOR_BITS = ("origin", "plus_limit", "minus_limit")


class AxisSensorsWire(Wire):
    """One digit of three bits."""

    pattern = "[0-7]"

    def encode(self, value: Any) -> str:
        """Write the digit."""
        return str(sum(getattr(value, name) << place for place, name in enumerate(SENSOR_BITS)))

    def decode(self, text: str) -> AxisSensors:
        """Read the digit."""
        return AxisSensors(**{name: bool(int(text) >> place & 1) for place, name in enumerate(SENSOR_BITS)})


B = TypeVar("B", AxisStatus, AxisSensors)


def rename_bits(axis: B, names: Sequence[str], others: Sequence[str]) -> B:
    """Give what each of the `names` of a status or of sensors says to the other name at its place."""
    known = type(axis).model_fields
    values = {new: getattr(axis, old) for old, new in zip(names, others, strict=True) if old in known}
    return axis.model_copy(update=values)


class SensorStates(Reply, args="{axes}"):
    """The sensors of each motor axis of the unit."""

    axes: Annotated[list[AxisSensors], ListLength, PerAxis(AxisSensorsWire(), hole=None)]


class GetAxisSensors(Query[SensorStates], code="ASD", example=("ASD", "ASD 1,0,6")):
    """軸センサステータス問い合わせ: get the sensors of the unit's motor axes."""
