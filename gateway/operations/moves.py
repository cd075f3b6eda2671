"""Moves in the words of clients: begun, planned without moving, and found again."""

from typing import Any

from pydantic import BaseModel

from gateway.core.errors import NotFound
from gateway.core.move_record import MoveRecord
from gateway.core.origin import current
from gateway.core.rights import Right
from gateway.core.targets import Result
from gateway.operations.caller import for_caller, require
from gateway.operations.commands import do
from gateway.plant import Plant


@for_caller
async def start(plant: Plant, target: str, request: Any, wait_s: float = 0.0) -> Result | BaseModel:
    """Start the move that a request of the target's family asks for, or work out what it would be.

    :raises GatewayError: it was refused, not sent, or can never be.
    """
    require(plant, Right.OPERATE, target, leased=not request.validate_only)
    addressed = plant.target(target)
    command = addressed.command_for(request)
    if request.validate_only:
        return await addressed.plan(command)
    return await do(plant, current(), target, command, wait_s)


def newest(plant: Plant, target: str, limit: int) -> list[Any]:
    """The moves of a body or a unit, newest first."""
    require(plant, Right.VIEW, target)
    addressed = plant.target(target)
    return addressed.log.of(addressed.address)[:limit]


async def get(plant: Plant, target: str, move_id: str, wait_s: float = 0.0) -> MoveRecord:
    """Give a move when it is over, or as it is when the time is up.

    :raises NotFound: the target has none of this id, or it is no longer kept.
    """
    require(plant, Right.VIEW, target)
    addressed = plant.target(target)
    move: MoveRecord = addressed.log.get(move_id)
    if move.body_id != addressed.address:
        raise NotFound(f"{addressed.address} has no move {move_id}.")
    await addressed.log.wait(move_id, wait_s)
    return move
