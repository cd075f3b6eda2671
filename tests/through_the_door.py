"""Requests of tests to a plant without HTTP: by the name of the operation, as every front end does."""

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


MOVES: Final = {"bodies": "Move", "groups": "GroupMove", "robots": "RobotMove", "scaras": "ScaraMove"}


def _named(path: str) -> tuple[str, dict[str, Any]]:
    """The kind of what a path leads to, and what it names."""
    _, kind, *parts = path.split("/")
    named: dict[str, Any] = {f"{'body' if kind == 'bodies' else kind[:-1]}_id": parts[0]}
    return MOVES[kind], named if len(parts) == 1 else {**named, "unit": int(parts[2])}


async def start(plant: Plant, caller: Origin, path: str, request: object, wait: float = 0.0) -> Any:
    """Start a move of what stands at a path, or work out what it would be."""
    kind, named = _named(path)
    return await ask(plant, f"start{kind}", caller=caller, request=request, wait=wait, **named)


async def get(plant: Plant, path: str, move_id: str, wait: float = 0.0) -> Any:
    """Find a move."""
    kind, named = _named(path)
    return await ask(plant, f"get{kind}", move_id=move_id, wait=wait, **named)
