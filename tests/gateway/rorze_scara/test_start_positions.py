"""Interpolated moves that clients prepare themselves: they start from where the axes stand, or not at all."""

import asyncio
import re
from collections.abc import Awaitable, Callable

import pytest

from gateway.core.errors import GatewayError
from gateway.core.move_record import MoveStatus
from gateway.rorze.moves import PreparationOutdated
from protocols.rorze.interpolation import (
    PrepareMoveAlongX,
    SetStartPosition,
    StartInterpolation,
    TurnFinger,
)
from protocols.rorze.moves import MoveClockwise
from tests.gateway.rorze_scara.cell import Cell, cell
from tests.plants import in_virtual_time

X_MOVE = PrepareMoveAlongX(distance=10_000, pattern=3)


async def tell(robot: Cell) -> None:
    """As RC-420 manual 13.10.7 has it: where each axis stands, to all controllers."""
    for axis, pulses in enumerate(robot.positions()):
        await robot.scara.group.ask(SetStartPosition(axis=axis, position=pulses))


async def prepare(robot: Cell) -> None:
    await tell(robot)
    await robot.scara.group.ask(X_MOVE)


async def start(robot: Cell) -> None:
    for move in await robot.rig.plant.moves.start(robot.scara.group, StartInterpolation()):
        assert (await robot.rig.plant.moves.wait(move.id, 60.0)).status is MoveStatus.SUCCEEDED


async def step(robot: Cell) -> None:
    """An axis is moved a little by a move of its own."""
    body = robot.scara.members[1]
    [move] = await robot.rig.plant.moves.start(body, MoveClockwise(distance=100))
    await robot.rig.plant.moves.wait(move.id, 60.0)


async def move_by_hand(robot: Cell) -> None:
    """Move an axis from another host, unseen by the gateway."""
    robot.rig.axis(3).execute("1+M100", asyncio.get_running_loop().time())
    await asyncio.sleep(30.0)


async def tell_one_otherwise(robot: Cell) -> None:
    await robot.scara.members[0].ask(SetStartPosition(axis=2, position=0))
    await robot.scara.members[0].ask(X_MOVE)


@in_virtual_time
async def test_what_was_prepared_where_the_axes_stand_is_started() -> None:
    async with cell() as robot:
        await prepare(robot)
        await start(robot)
        assert robot.place().x == pytest.approx(10_000, abs=60)


@pytest.mark.parametrize(
    ("meanwhile", "why"),
    [
        (step, "Nobody has prepared line1.03 since"),
        (move_by_hand, "line1.03 stands at -9900"),
        (tell, "Nobody has prepared line1.02 since"),
        (tell_one_otherwise, "line1.02 was told that axis 2 stands at 0,"),
        (start, "Nobody has prepared line1.02 since"),
    ],
)
@in_virtual_time
async def test_what_has_changed_since_the_preparation_keeps_the_move_from_starting(
    meanwhile: Callable[[Cell], Awaitable[None]], why: str
) -> None:
    async with cell() as robot:
        await prepare(robot)
        await meanwhile(robot)
        stood, started = robot.positions(), len(robot.frames_of("HMM"))
        with pytest.raises(PreparationOutdated, match=why) as refusal:
            await start(robot)
        assert refusal.value.moved == "no"
        assert (robot.positions(), len(robot.frames_of("HMM"))) == (stood, started)
        assert robot.rig.plant.moves.log.of(robot.scara.members[0].address)[0].status is MoveStatus.CANCELLED
        await prepare(robot)
        await start(robot)


@in_virtual_time
async def test_the_finger_turns_from_where_it_was_told_to_stand() -> None:
    async with cell() as robot:
        finger = robot.scara.members[-1]
        turn = TurnFinger(angle=60_000, pattern=4)
        with pytest.raises(PreparationOutdated, match=r"line1\.04 was told that axis 2 stands at 0,"):
            await robot.rig.plant.moves.start(finger, turn)
        await tell(robot)
        [move] = await robot.rig.plant.moves.start(finger, turn)
        assert (await robot.rig.plant.moves.wait(move.id, 60.0)).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_a_controller_that_does_not_tell_is_not_started() -> None:
    async with cell() as robot:
        await prepare(robot)
        robot.rig.wire.deaf_to = re.compile(rb">&8AHPD[^\r]*\r")
        with pytest.raises(GatewayError, match="did not tell what its move was prepared for"):
            await start(robot)
        assert robot.frames_of("HMM") == []
