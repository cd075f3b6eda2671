"""A line that another gateway has lost in the middle of moves: the new owner goes on with them."""

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gateway.core.move_record import MoveStatus
from gateway.rorze.move_requests import BodyJogRequest
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveAbsolute
from protocols.rorze.moves import MoveClockwise
from tests.plants import in_virtual_time
from tests.tested_plant import TestedPlant
from tests.world import World

SPARE = '\n[plant]\nname = "spare1"\nservers = ["nats://127.0.0.1:4222"]\n'
OWNERS = 'owners = ["stocker1", "spare1"]\n'


def at_the_spare(world: World, folder: Path) -> World:
    """This line at another gateway, which has a data directory of its own."""
    head, _, rest = world.text.partition("[[lines]]\n")
    return replace(world, folder=folder, text=f"{head}[[lines]]\n{OWNERS}{rest}{SPARE}")


def told(plant: TestedPlant, line: str) -> list[dict[str, Any]]:
    """The moves under way as the old owner tells them of itself."""
    return [it.model_dump(mode="json") for it in plant.moves_under_way(line)]


async def take_over(plant: TestedPlant, line: str, left: list[dict[str, Any]]) -> None:
    await asyncio.sleep(0.5)
    assert plant.port(line).state == "standby"
    plant.peers.ownership.note_left(line, "stocker1", left)
    await plant.take_over(line, "stocker1")


async def jogged(plant: TestedPlant) -> None:
    await plant.rorze.jogs.start(plant.body("3F"), BodyJogRequest(direction="cw"))
    await asyncio.sleep(0.4)


async def moved(plant: TestedPlant) -> None:
    await plant.moves.start(plant.body("3F"), MoveClockwise(distance=5_000))


@pytest.mark.parametrize(
    ("begin", "end"), [(moved, MoveStatus.SUCCEEDED), (jogged, MoveStatus.UNKNOWN)], ids=["move", "jog"]
)
def test_the_new_owner_follows_the_moves_of_bodies_and_says_what_nothing_proves(
    begin: Any, end: MoveStatus, tmp_path: Path
) -> None:
    @in_virtual_time
    async def story() -> None:
        world = World(tmp_path / "old")
        async with world.gateway() as old:
            await asyncio.sleep(2.0)
            await begin(old)
            [left] = told(old, "line1")
        async with at_the_spare(world, tmp_path / "new").gateway() as new:
            await take_over(new, "line1", [left])
            move = await new.moves.wait(left["id"], 60.0)
            assert move.status is end, move
            assert any("Gateway spare1 took the line over from stocker1" in it for it in move.evidence)
        assert len([it for it in world.wire.frames() if "+M" in it]) == 1, "nothing is sent again"

    story()


def test_the_new_owner_follows_the_move_of_a_robot(tmp_path: Path) -> None:
    @in_virtual_time
    async def story() -> None:
        world = World.of_robot(tmp_path / "old", mode=3)
        async with world.gateway() as old:
            await asyncio.sleep(1.0)
            robot = old.robot("r1")
            homed = await old.robot_moves.start(robot, robot.unit(1), HomeRobot(), 5.0)
            await old.robot_moves.wait(homed.id, 600.0)
            command = MoveAbsolute(coordinates=[None, None, 20.0])
            begun = await old.robot_moves.start(robot, robot.unit(1), command, 5.0)
            left = told(old, "cell")
        async with at_the_spare(world, tmp_path / "new").gateway() as new:
            await take_over(new, "cell", left)
            move = await new.robot_moves.wait(begun.id, 600.0)
            assert move.status is MoveStatus.SUCCEEDED, move
            assert any("took the line over from stocker1" in it for it in move.evidence)

    story()


@pytest.mark.parametrize(
    "strange", [{}, {"body_id": "line1.3F", "id": "x"}, {"body_id": "other.3F", "id": "x"}]
)
def test_what_cannot_be_read_of_the_old_owner_hinders_no_take_over(
    strange: dict[str, Any], tmp_path: Path
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with at_the_spare(World(tmp_path), tmp_path / "new").gateway() as new:
            await take_over(new, "line1", [strange])
            await asyncio.sleep(3.0)
            assert new.port("line1").state == "ready"
            assert new.moves.log.under_way() == []

    story()
