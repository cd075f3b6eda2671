"""The questions that are put again and again: built once, so that each is written out once."""

from collections.abc import Mapping
from typing import Any, Final

from gateway.fics.axes import Coordinates
from protocols.fics.motor_axes import GetMotorPosition
from protocols.fics.row import FicsCommand
from protocols.fics.status import GetAxisSensors, GetAxisStatus, GetUserPosition
from protocols.fics.system import GetCommunicationMode, GetUnit

MODE: Final = GetCommunicationMode()
UNIT: Final = GetUnit()
STATUS: Final = GetAxisStatus()
SENSORS: Final = GetAxisSensors()
PLACES: Final = GetMotorPosition()
"""Where the motors stand: known only of those that are homed (C-HOST manual 4-4)."""
POSITIONS: Final[Mapping[Coordinates, FicsCommand[Any]]] = {
    "user": GetUserPosition(),
    "motor": PLACES,
}
