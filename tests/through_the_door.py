"""What tests ask a plant without HTTP: by the name of the operation, as every front end does."""

from typing import Any, Final

from gateway.core.alarms import Alarm
from gateway.core.operation import Operation
from gateway.core.origin import Origin, acting
from gateway.door import operations
from gateway.door.calls import carry_out
from gateway.door.configuration import NewBodies, NewLine, Reloaded, ReloadRequest
from gateway.plant import Plant

ME: Final = Origin("test", "r-1")
OPERATIONS: Final[dict[str, Operation]] = {operation.name: operation for operation in operations()}


async def ask(
    plant: Plant, name: str, /, *, request: object = None, caller: Origin = ME, **values: Any
) -> Any:
    """Let an operation be carried out; `values` are those of path and query."""
    operation = OPERATIONS[name]
    if operation.request_name is not None and request is not None:
        values[operation.request_name] = request
    with acting(caller):
        return await carry_out(plant, operation, values)


async def reset(plant: Plant, caller: Origin, alarm_id: str) -> Alarm:
    """Reset an alarm."""
    alarm: Alarm = await ask(plant, "resetAlarm", caller=caller, alarm_id=alarm_id)
    return alarm


async def reload(plant: Plant, caller: Origin, *, dry_run: bool) -> Reloaded:
    """Read the configuration again."""
    wanted = ReloadRequest(dry_run=dry_run)
    told: Reloaded = await ask(plant, "reloadConfiguration", caller=caller, request=wanted)
    return told


async def add_line(
    plant: Plant, caller: Origin, line: dict[str, Any], *, comment: str = "", dry_run: bool
) -> Reloaded:
    """Add a line to the configuration."""
    wanted = NewLine(line=line, comment=comment, dry_run=dry_run)
    told: Reloaded = await ask(plant, "addLine", caller=caller, request=wanted)
    return told


async def add_bodies(
    plant: Plant, caller: Origin, line_id: str, bodies: list[dict[str, Any]], *, dry_run: bool
) -> Reloaded:
    """Add bodies to a line of the configuration."""
    wanted = NewBodies.model_construct(bodies=bodies, comment="", dry_run=dry_run)
    told: Reloaded = await ask(plant, "addBodies", caller=caller, line_id=line_id, request=wanted)
    return told
