"""SCARA robots over restarts of the gateway: a move goes on in its own record, and nothing is sent again."""

import asyncio
from pathlib import Path

import pytest

from gateway.core.move_record import MoveStatus
from gateway.rorze_scara import geometry
from gateway.rorze_scara.extension import Scaras
from gateway.rorze_scara.record import ScaraMove
from gateway.rorze_scara.scara import Scara
from protocols.rorze.position import SetPosition
from simulator.rorze.line import build_line
from simulator.rorze.world import EMS
from tests.gateway.rorze_scara.cell import SCARA, SLOW, START, mm, read
from tests.plants import Wire, configuration, in_virtual_time
from tests.tested_plant import TestedPlant
from tests.world import World

BODIES = (0x02, 0x03, 0x04)
LINE = read("line", x=mm(0), y=mm(215), pattern=5)


@pytest.fixture
def world(tmp_path: Path) -> World:
    text = configuration(bodies=BODIES, groups={}, more=SCARA)
    return World(tmp_path / "data", Wire(build_line(BODIES, 0.0, seed=1), 9600), text)


async def taught(plant: TestedPlant, world: World) -> Scara:
    """The robot, ready to move, where the manual has it."""
    while plant.line("line1").state != "ready":  # noqa: ASYNC110  # no event
        await asyncio.sleep(0.1)
    scara = plant.family(Scaras).find("wafer")
    assert isinstance(world.wire, Wire)
    for body, position in zip(scara.members, START, strict=True):
        for text in SLOW:
            world.wire.machine.axes[body.number].execute(text, asyncio.get_running_loop().time())
        await body.ask(SetPosition(position=position))
    await geometry.write(scara, flash=False)
    return scara


async def over(plant: TestedPlant, move_id: str) -> ScaraMove:
    return await plant.family(Scaras).moves.log.wait(move_id, 60.0)


@in_virtual_time
async def test_moves_are_there_again(world: World) -> None:
    async with world.gateway() as plant:
        scara = await taught(plant, world)
        move = await over(plant, (await plant.family(Scaras).moves.start(scara, LINE)).id)
    async with world.gateway() as plant:
        assert plant.family(Scaras).moves.log.of("wafer") == [move]
        assert plant.family(Scaras).find("wafer").move is None


@in_virtual_time
async def test_a_move_goes_on_in_its_own_record_after_a_crash(world: World) -> None:
    async with world.gateway() as plant:
        scara = await taught(plant, world)
        move = await plant.family(Scaras).moves.start(scara, LINE)
        await asyncio.sleep(0.5)
        world.crash()
    async with world.gateway() as plant:
        assert plant.family(Scaras).find("wafer").move is plant.family(Scaras).moves.log.get(move.id)
        end = await over(plant, move.id)
        assert (end.status, end.end_cause) == (MoveStatus.SUCCEEDED, "normal")
        assert end.coordinates is not None
        assert end.coordinates.y.value == pytest.approx(215_000, abs=60)
        assert "restarted" in end.evidence[0]
        assert plant.family(Scaras).find("wafer").move is None
    assert len(world.sent("HMM")) == 1


@in_virtual_time
async def test_an_axis_that_fails_after_a_restart_stops_the_others(world: World) -> None:
    async with world.gateway() as plant:
        scara = await taught(plant, world)
        move = await plant.family(Scaras).moves.start(scara, LINE)
        world.crash()
    async with world.gateway() as plant:
        while plant.line("line1").state != "ready":  # noqa: ASYNC110  # no event
            await asyncio.sleep(0.1)
        await asyncio.sleep(0.5)
        assert isinstance(world.wire, Wire)
        axis = world.wire.machine.axes[0x03]
        axis.world.forced[EMS] = True
        axis.sense(asyncio.get_running_loop().time())
        world.wire.machine.look_after(0x03)
        world.wire.turn()
        end = await over(plant, move.id)
        assert (end.status, end.failed_axes, end.end_cause) == (MoveStatus.FAILED, [1], "ems")
        assert not any(it.motor.moving for it in world.wire.machine.axes.values())


@in_virtual_time
async def test_what_was_still_being_prepared_has_moved_nothing(world: World) -> None:
    async with world.gateway() as plant:
        scara = await taught(plant, world)
        starting = asyncio.create_task(plant.family(Scaras).moves.start(scara, LINE))
        assert isinstance(world.wire, Wire)
        await world.wire.begun("&8AHPS1,-10000")
        world.crash()
        starting.cancel()
    async with world.gateway() as plant:
        [move] = plant.family(Scaras).moves.log.of("wafer")
        assert (move.status, move.error and move.error.moved) == (MoveStatus.CANCELLED, "no")


@in_virtual_time
async def test_a_robot_of_other_bodies_cannot_tell(world: World) -> None:
    async with world.gateway() as plant:
        scara = await taught(plant, world)
        move = await plant.family(Scaras).moves.start(scara, LINE)
        world.crash()
    world.text = world.text.replace('["02", "03", "04"]', '["02", "04", "03"]')
    async with world.gateway() as plant:
        end = await over(plant, move.id)
        assert end.status is MoveStatus.UNKNOWN
        assert end.error is not None
        assert (end.error.moved, "other bodies" in end.error.detail) == ("unknown", True)
