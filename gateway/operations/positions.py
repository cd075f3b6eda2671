"""Stored positions of a robot's units."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from gateway.core.errors import InvalidRequest
from gateway.core.rights import Right
from gateway.fics.amounts import Amounts, numbers
from gateway.fics.family import Fics
from gateway.fics.robot import Robot
from gateway.operations.caller import needs
from gateway.plant import Plant
from protocols.fics.positions import LAST_POSITION

Numbered = tuple[int, list[float | None]]
"""A position's number, and its coordinates in the order of the axes."""

Wanted = tuple[int, list[float | None] | None]
"""The same to be stored; without coordinates, where the unit stands."""


class Stored(NamedTuple):
    """Positions that a robot holds."""

    positions: list[Numbered]
    ended_at: int | None
    """The number that is not set, where the robot ended before the last that was asked for."""


@needs(Right.VIEW)
async def read(plant: Plant, robot_id: str, unit: int, first: int, last: int) -> Stored:
    """Read stored positions; the robot ends at the first number that is not set.

    :raises InvalidRequest: the last is before the first.
    :raises GatewayError: they were not read; errors as of `download`.
    """
    return await _read(plant.family(Fics).robot(robot_id), unit, first, last)


async def _read(robot: Robot, unit: int, first: int, last: int) -> Stored:
    robot.unit(unit)
    if last < first:
        raise InvalidRequest(f"last: it is less than first, {first}; nothing was sent.")
    stored = await robot.positions(first, last, unit)
    following = stored[-1][0] + 1 if stored else first
    return Stored(stored, following if following <= last else None)


@needs(Right.SETUP)
async def store(
    plant: Plant,
    robot_id: str,
    unit: int,
    positions: Sequence[Wanted],
    known: Sequence[int] = (1, LAST_POSITION),
    expects: Callable[[Stored], None] | None = None,
) -> None:
    """Store positions undivided, and see that the robot holds them.

    `expects` refuses what the robot holds if the sender does not know it, from the first to the last `known`.
    Errors as of `tables.store`, and as of `tables.here` where one is to be where the unit stands.
    """
    robot = plant.family(Fics).robot(robot_id)
    since = await robot.asking.as_expected(lambda: _read(robot, unit, *known), expects)
    here: list[float | None] = []
    if any(coordinates is None for _, coordinates in positions):
        here = await robot.tables.here(robot.unit(unit))
    stored = [(number, here if axes is None else axes) for number, axes in positions]
    await robot.upload_positions(stored, unit, since=since)


def in_order(plant: Plant, robot_id: str, unit: int, field: str, axes: Amounts) -> list[float | None]:
    """Put coordinates given by name into the order of the axes; errors as of `amounts.numbers`."""
    it = plant.family(Fics).robot(robot_id).unit(unit)
    return numbers(field, it, it.axes, axes)
