"""Long work over restarts: it is found again, and what a crash has cut off says what it has left."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gateway.core.backup_record import Restore
from gateway.core.origin import Origin
from gateway.core.works import GATEWAY_ENDED
from gateway.door import backups
from gateway.fics.door import backups as of_robots
from gateway.rorze.door import backups as of_bodies
from gateway.rorze.door.programs import ProgramSource
from gateway.rorze.positions import WantedPosition
from gateway.rorze.program_runs import ProgramRun
from gateway.rorze.program_uploads import ProgramUpload
from protocols.rorze.programs import RunProgram
from simulator.rorze.controller import Rc420
from tests.fics_plants import Cable
from tests.plants import Wire, configuration, in_virtual_time
from tests.tested_plant import TestedPlant
from tests.through_the_door import ask
from tests.world import World

ME = Origin("test")
SOURCE = "".join(f"SETOD{number % 16}\n" for number in range(60))
SPEEDS = "".join(f"OLSS[{it}],60\nOHSS[{it}],40000\nOSSS[{it}],90000\n" for it in range(10))
BACKUP = f"[body 3F]\n[speed-sets]\n{SPEEDS}"
BAUD = 9600
WAITING = ("*W", "WAT50", "JMP*W")


@pytest.fixture
def world(tmp_path: Path) -> World:
    return World(tmp_path / "data")


async def ready(plant: TestedPlant) -> None:
    while any(port.state != "ready" for port in plant.ports().values()):  # noqa: ASYNC110
        await asyncio.sleep(0.1)
    await asyncio.sleep(2.0)


async def until(true: Callable[[], bool]) -> None:
    while not true():  # noqa: ASYNC110
        await asyncio.sleep(0.05)


def wire_of(world: World) -> Wire:
    assert isinstance(world.wire, Wire)
    return world.wire


def slow(world: World) -> None:
    """Let the wire take its time."""
    wire = world.wire
    world.wire = Wire(wire.machine, BAUD) if isinstance(wire, Wire) else Cable(wire.machine, BAUD)


def axis_of(world: World) -> Rc420:
    return wire_of(world).machine.axes[0x3F]


def types(plant: TestedPlant) -> list[str]:
    numbers = range(plant.events.first, plant.events.last + 1)
    return [plant.events.event(number).type for number in numbers]


async def upload(plant: TestedPlant, *, wait_s: float = 0.0, flash: bool = False) -> ProgramUpload:
    await ready(plant)
    wanted = ProgramSource(source=SOURCE, flash=flash)
    begun: ProgramUpload = await ask(plant, "uploadProgram", body_id="3F", request=wanted, wait=wait_s)
    return begun


def found(plant: TestedPlant, begun: ProgramUpload) -> ProgramUpload:
    record = plant.rorze.uploads.find("line1.3F", begun.id)
    assert record is not None
    return record


@in_virtual_time
async def test_an_upload_that_is_over_is_found_again_as_it_was(world: World) -> None:
    async with world.gateway() as plant:
        over = await upload(plant, wait_s=60.0)
        assert over.status == "succeeded"
        world.crash()
    async with world.gateway() as plant:
        assert found(plant, over) == over
        assert plant.rorze.uploads.current("line1.3F") is None


@in_virtual_time
async def test_an_upload_that_a_crash_has_cut_off_says_what_it_has_left(world: World) -> None:
    slow(world)
    async with world.gateway() as plant:
        begun = await upload(plant)
        await until(lambda: len(world.sent("UWS")) > 20)
        world.crash()
    held = len(axis_of(world).program)
    async with world.gateway() as plant:
        record = found(plant, begun)
        assert (record.status, record.phase, record.ended_at is None) == ("failed", "writing", False)
        assert record.written <= held
        assert f"RAM held the first {record.written} of 60 instructions, and perhaps more" in record.stored
        assert record.error is not None
        assert (record.error.type, record.error.remedy) == (GATEWAY_ENDED.kind, "Upload the program again.")
        assert "body.program.upload.failed" in types(plant)
        assert any(alarm.cause == "body.program.upload.failed" for alarm in plant.alarms.standing())
        assert (await upload(plant, wait_s=60.0)).status == "succeeded"


@in_virtual_time
async def test_an_upload_that_the_end_of_the_gateway_has_cancelled_says_so_afterwards(world: World) -> None:
    async with world.gateway() as plant:
        begun = await upload(plant)
        await until(lambda: len(world.sent("UWS")) > 20)
    async with world.gateway() as plant:
        record = found(plant, begun)
        assert record.status == "cancelled"
        assert record.error is not None
        assert record.error.type == "shutting-down"


async def restore_to_body(plant: TestedPlant) -> Restore:
    wanted = of_bodies.for_body(plant, "3F", of_bodies.check_bodies(BACKUP), None)
    return await backups.start(plant, wanted, False, False, 0.0)


async def restore_to_robot(plant: TestedPlant) -> Restore:
    table = "".join(f"{number} X={number} Z=-7\n" for number in range(1, 60))
    found = of_robots.check_robot(plant, "r1", f"[robot r1]\n[unit 1 positions]\n{table}")
    return await backups.start(plant, of_robots.for_robot(plant, "r1", found), False, False, 0.0)


@pytest.mark.parametrize("family", ["body", "robot"])
@in_virtual_time
async def test_a_restore_that_a_crash_has_cut_off_says_what_it_has_left(family: str, tmp_path: Path) -> None:
    world = World(tmp_path / "data") if family == "body" else World.of_robot(tmp_path / "data", mode=3)
    world.wire = (
        Wire(world.wire.machine, BAUD) if isinstance(world.wire, Wire) else Cable(world.wire.machine, BAUD)
    )
    async with world.gateway() as plant:
        await ready(plant)
        begun = await (restore_to_body if family == "body" else restore_to_robot)(plant)
        await until(lambda: begun.written > 3)
        await asyncio.sleep(1.0)
        world.crash()
        assert begun.status == "running"
    async with world.gateway() as plant:
        restores = plant.rorze.restores if family == "body" else plant.fics.restores
        record = restores.find(begun.target, begun.id)
        assert record is not None
        assert (record.status, record.differences) == ("failed", None)
        assert record.error is not None
        assert record.error.type == GATEWAY_ENDED.kind
        assert f"{record.written} of {record.commands} commands had been written, perhaps more" in (
            record.error.detail
        )
        assert f"{family}.restore.failed" in types(plant)


@in_virtual_time
async def test_positions_that_were_being_stored_are_told_as_far_as_is_known(world: World) -> None:
    async def nobody(_: Any) -> list[Any]:
        return []

    async with world.gateway() as plant:
        await ready(plant)
        table = [WantedPosition(number, number + 1) for number in range(40)]
        begun = plant.rorze.position_uploads.start(plant.body("3F"), table, flash=False, named=nobody)
        await until(lambda: begun.read > 10)
        world.crash()
    async with world.gateway() as plant:
        record = plant.rorze.position_uploads.find("/bodies/line1.3F", begun.id)
        assert record is not None
        assert record.error is not None
        assert (record.status, record.error.type) == ("failed", GATEWAY_ENDED.kind)
        assert "of 40 positions were sent, perhaps one more, and none read back" in record.error.detail


async def run(plant: TestedPlant, world: World) -> ProgramRun:
    await ready(plant)
    axis_of(world).program = WAITING
    return await plant.rorze.runs.start(plant.body("3F"), RunProgram())


@in_virtual_time
async def test_a_run_that_a_crash_has_left_is_followed_to_its_end(world: World) -> None:
    async with world.gateway() as plant:
        begun = await run(plant, world)
        world.crash()
    async with world.gateway() as plant:
        await ready(plant)
        record = plant.rorze.runs.find("line1.3F", begun.id)
        assert record is not None
        assert record.status == "running"
        assert plant.body("3F").life.in_program
        await plant.stops.stop([plant.body("3F")], "immediate")
        await plant.rorze.runs.wait(record, 10.0)
        assert (record.status, record.end_cause) == ("ended", "stopped")
        assert not plant.body("3F").life.in_program
    async with world.gateway() as plant:
        assert plant.rorze.runs.find("line1.3F", begun.id) == record


@in_virtual_time
async def test_how_a_run_has_ended_is_not_known_where_the_power_was_lost_meanwhile(world: World) -> None:
    async with world.gateway() as plant:
        await ready(plant)
        await until(lambda: plant.body("3F").power.mark.text is not None)
        begun = await run(plant, world)
        world.crash()
    wire_of(world).machine.brown_out(0x3F, 0.05, asyncio.get_running_loop().time())
    await asyncio.sleep(1.0)
    async with world.gateway() as plant:
        await ready(plant)
        record = plant.rorze.runs.find("line1.3F", begun.id)
        assert record is not None
        await plant.rorze.runs.wait(record, 10.0)
        assert (record.status, record.end_cause) == ("unknown", None)
        assert record.detail == "line1.3F has lost its power."


@in_virtual_time
async def test_a_run_of_a_body_that_is_not_configured_any_more_is_not_known(world: World) -> None:
    async with world.gateway() as plant:
        begun = await run(plant, world)
        world.crash()
    world.text = configuration(bodies=(0x00,), groups={})
    async with world.gateway() as plant:
        record = plant.rorze.runs.find("line1.3F", begun.id)
        assert record is not None
        assert (record.status, record.detail) == ("unknown", "The gateway has ended in the middle of it.")
