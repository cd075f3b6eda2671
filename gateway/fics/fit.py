"""What a unit can take of a command of the table: values for no more axes than it has, and axes it has."""

from collections.abc import Mapping
from typing import Any, Final

from gateway.fics.axes import UnitAxes
from gateway.fics.settings import SETTINGS, AxisSettingRows, Row
from protocols.fics.jog import StartJog, StepAxis, StopJog
from protocols.fics.row import FicsCommand

_SETTINGS: Final[Mapping[Row, AxisSettingRows]] = {setting.write: setting for setting in SETTINGS.values()}


def require_fit(unit: UnitAxes, command: FicsCommand[Any]) -> None:
    """Refuse what the unit cannot take, whatever its state; coordinates of moves are looked at with the move.

    :raises InvalidRequest: more values than axes, no such axis, or a fraction of a pulse.
    """
    if isinstance(command, StartJog | StepAxis | StopJog):
        unit.require_axis(command.axis)
    if setting := _SETTINGS.get(type(command)):
        values = getattr(command, setting.field)
        unit.require_values(setting.coordinates, values, setting.quantity, setting.field)
