"""Settings of a robot's units, as a whole."""

from collections.abc import Callable

from gateway.core.rights import Right
from gateway.fics import settings
from gateway.fics.family import Fics
from gateway.fics.settings import SettingsChange, UnitSettings
from gateway.operations.caller import needs
from gateway.plant import Plant


@needs(Right.VIEW)
async def read(plant: Plant, robot_id: str, unit: int) -> UnitSettings:
    """Read all settings of a unit; errors as of `settings.read`."""
    return await settings.read(plant.family(Fics).robot(robot_id).unit(unit))


@needs(Right.SETUP)
async def change(
    plant: Plant,
    robot_id: str,
    unit: int,
    wanted: SettingsChange,
    expects: Callable[[UnitSettings], None] | None = None,
) -> UnitSettings:
    """Change settings of a unit and read them back; errors as of `settings.change`."""
    return await settings.change(plant.family(Fics).robot(robot_id).unit(unit), wanted, expects)
