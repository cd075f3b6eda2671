"""Moves in the words of clients: begun, planned without moving, and found again."""

import asyncio
from typing import Any

from pydantic import BaseModel

from gateway.core.errors import MoveOver, NotFound
from gateway.core.move_record import MoveRecord
from gateway.core.origin import current
from gateway.core.rights import Right
from gateway.core.targets import AnyCommand, Result
from gateway.door.caller import for_caller, needs, require
from gateway.door.doing import ask
from gateway.plant import Plant
from protocols.wording import as_given


@for_caller
async def start(plant: Plant, target: str, request: Any, wait_s: float = 0.0) -> Result | BaseModel:
    """Start the move that a request of the target's family asks for, or work out what it would be.

    :raises GatewayError: it was refused, not sent, or can never be.
    """
    require(plant, Right.OPERATE, target, leased=not request.validate_only)
    addressed = plant.target(target)
    if request.validate_only:
        return await addressed.plan(addressed.command_for(request), getattr(request, "max_speed", None))
    plant.require_unlatched(addressed.address)
    loop = asyncio.get_running_loop()
    late_at = loop.time() + request.start_within_s
    async with addressed.at_own_speed(request) as ready:
        begun = await addressed.start(addressed.command_for(ready), max(0.0, late_at - loop.time()))
    return await addressed.wait_for(begun, wait_s)


def newest(plant: Plant, target: str, limit: int) -> list[Any]:
    """The moves of a body or a unit, newest first."""
    require(plant, Right.VIEW, target)
    addressed = plant.target(target)
    return addressed.log.of(addressed.address, limit)


@needs(Right.OPERATE)
async def change_speed(plant: Plant, target: str, move_id: str, command: AnyCommand) -> MoveRecord:
    """Change the speed of a move on its way.

    :raises NotFound: the target has none of this id, or it is no longer kept.
    :raises MoveOver: it has ended; nothing was sent.
    :raises GatewayError: it was refused, as while homing and interpolating, or not sent.
    """
    move = await get(plant, target, move_id)
    if move.status.final:
        raise MoveOver(f"The move {move_id} has ended ({move.status}); {command.name()} was not sent.")
    await ask(plant, current(), target, command)
    return move


async def get(plant: Plant, target: str, move_id: str, wait_s: float = 0.0) -> MoveRecord:
    """Give a move when it is over, or as it is when the time is up.

    :raises NotFound: the target has none of this id, or it is no longer kept.
    """
    require(plant, Right.VIEW, target)
    addressed = plant.target(target)
    move: MoveRecord = addressed.log.get(move_id)
    if move.body_id != addressed.address:
        raise NotFound(f"{addressed.address} has no move {as_given(move_id)}.")
    await addressed.log.wait(move_id, wait_s)
    return move


@needs(Right.VIEW)
async def samples(plant: Plant, target: str, move_id: str) -> Any:
    """Give where a body or a unit was seen during a move, and where the plan has it, if there is one.

    :raises NotFound: the target has none of this id, or nothing is kept of it.
    """
    await get(plant, target, move_id)
    return await plant.target(target).samples(move_id)
