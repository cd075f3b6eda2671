"""What a unit can take of a command of the table: values for no more axes than it has, and axes it has."""

from collections.abc import Mapping
from typing import Any, Final

from api.robots.axes import system_of
from api.robots.settings import SETTINGS, Row, Setting
from gateway.errors import InvalidRequest
from gateway.fics.units import RobotUnit
from protocols.fics.jog import StartJog, StepAxis, StopJog
from protocols.fics.row import FicsCommand

_SETTINGS: Final[Mapping[Row, Setting]] = {setting.write: setting for setting in SETTINGS.values()}


def require_fit(unit: RobotUnit, command: FicsCommand[Any]) -> None:
    """Refuse what the unit cannot take, whatever its state; coordinates of moves are looked at with the move.

    :raises InvalidRequest: more values than axes, no such axis, or a fraction of a pulse.
    """
    if isinstance(command, StartJog | StepAxis | StopJog):
        require_axis(unit, command.axis)
    if setting := _SETTINGS.get(type(command)):
        _require_values_fit(unit, setting, getattr(command, setting.field))


def require_axis(unit: RobotUnit, axis: str) -> None:
    """Refuse an axis that is neither a user axis nor a motor axis.

    :raises InvalidRequest: it is neither.
    """
    if axis not in (*unit.axes, *unit.motor_axes):
        names = ", ".join(dict.fromkeys([*unit.axes, *unit.motor_axes]))
        raise InvalidRequest(f"axis: {unit.address} has the axes {names}; nothing was sent.")


def _require_values_fit(unit: RobotUnit, setting: Setting, values: list[float | None]) -> None:
    names = unit.names(setting.coordinates)
    if len(values) > len(names):
        raise InvalidRequest(
            f"{setting.field}: {unit.address} has the axes {', '.join(names)}, and {len(values)} values were "
            "given; nothing was sent."
        )
    for place, (axis, value) in enumerate(zip(names, values, strict=False)):
        if value is None or setting.quantity is None:
            continue
        if not system_of(unit, axis).can_hold(setting.quantity, value):
            raise InvalidRequest(
                f"{setting.field}.{place}: axis {axis} counts whole pulses; nothing was sent."
            )
