"""Moves in the words of clients: begun, planned without moving, and found again."""

import asyncio
from typing import Annotated, Any

from pydantic import BaseModel, Field

from gateway.core.errors import MoveOver, NotFound
from gateway.core.move_record import MoveRecord
from gateway.core.targets import AnyCommand, Result, Target
from gateway.plant import Plant
from protocols.wording import as_given

Limit = Annotated[int, Field(ge=1, le=1000)]
"""Number of records listed, the newest."""


async def start(plant: Plant, target: Target, request: Any, wait_s: float = 0.0) -> Result | BaseModel:
    """Start the move that a request of the target's family asks for, or work out what it would be.

    :raises GatewayError: it was refused, not sent, or can never be.
    """
    if request.validate_only:
        return await target.plan(target.command_for(request), getattr(request, "max_speed", None))
    plant.require_unlatched(target.address)
    loop = asyncio.get_running_loop()
    late_at = loop.time() + request.start_within_s
    async with target.at_own_speed(request) as ready:
        begun = await target.start(target.command_for(ready), max(0.0, late_at - loop.time()))
    return await target.wait_for(begun, wait_s)


def newest(target: Target, limit: int) -> list[Any]:
    """Newest moves, newest first."""
    return target.log.of(target.address, limit)


async def change_speed(target: Target, move_id: str, command: AnyCommand) -> MoveRecord:
    """Change the speed of a move on its way.

    :raises NotFound: the target has none of this id, or it is no longer kept.
    :raises MoveOver: it has ended; nothing was sent.
    :raises GatewayError: it was refused, as while homing and interpolating, or not sent.
    """
    move = await get(target, move_id)
    if move.status.final:
        raise MoveOver(f"The move {move_id} has ended ({move.status}); {command.name()} was not sent.")
    await target.ask(command)
    return move


async def get(target: Target, move_id: str, wait_s: float = 0.0) -> MoveRecord:
    """Give a move when it is over, or as it is when the time is up.

    :raises NotFound: the target has none of this id, or it is no longer kept.
    """
    move: MoveRecord = target.log.get(move_id)
    if move.body_id != target.address:
        raise NotFound(f"{target.address} has no move {as_given(move_id)}.")
    await target.log.wait(move_id, wait_s)
    return move


async def samples(target: Target, move_id: str) -> Any:
    """Give where a body or a unit was seen during a move, and where the plan has it, if there is one.

    :raises NotFound: the target has none of this id, or nothing is kept of it.
    """
    await get(target, move_id)
    return await target.samples(move_id)
