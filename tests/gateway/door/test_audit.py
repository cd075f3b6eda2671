"""The audit: who did what, from the journal, over restarts."""

import asyncio
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

import pytest

from gateway.core.errors import ControllerRefused, NotFound
from gateway.core.origin import Origin
from gateway.door.audit import AuditFilter, Deed, deeds
from gateway.door.doing import do
from gateway.door.stopping import stop
from gateway.plant import Plant
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.speeds import GetMaximumSpeed, SetMaximumSpeed
from simulator.rorze.world import EMS
from tests.plants import SET_UP_S, Wire, in_virtual_time, rig
from tests.world import World

PAT: Final = Origin("pat (http 10.0.0.7)", "r-1")
KIM: Final = Origin("kim (http 10.0.0.8)", "r-2")


async def found(plant: Plant, limit: int = 100, **wanted: object) -> list[Deed]:
    return list(await deeds(plant, AuditFilter(**wanted), limit))  # type: ignore[arg-type]


async def work(plant: Plant) -> None:
    await asyncio.sleep(SET_UP_S)
    await do(plant, PAT, "/bodies/3F", GetMaximumSpeed(speed_set=None))
    await do(plant, PAT, "/bodies/3F", SetMaximumSpeed(speed_set=None, speed=5000))
    await do(plant, KIM, "/bodies/00", MoveClockwise(distance=500), 60.0)
    await stop(plant, PAT, "/bodies/00", "immediate")


@in_virtual_time
async def test_it_tells_who_did_what_with_which_outcome_over_restarts(tmp_path: Path) -> None:
    world = World(tmp_path / "data")
    async with world.gateway() as plant:
        await work(plant)
    async with world.gateway() as plant:
        told = await found(plant)
        assert {deed.effect for deed in told} == {"motion", "setting", "stop"}, "reads are no deeds"
        setting = told[-1]
        assert (setting.caller, setting.request_id, setting.target) == (PAT.caller, "r-1", "line1.3F")
        assert (setting.outcome, setting.moves) == ("answered", [])
        assert setting.written_at is not None
        [move] = plant.moves.log.of(plant.body("00").address)
        assert [deed.moves for deed in told if deed.effect == "motion"] == [[move.id]]


@in_virtual_time
async def test_it_is_searched_by_caller_target_and_time_and_read_page_by_page(tmp_path: Path) -> None:
    async with World(tmp_path / "data").gateway() as plant:
        await work(plant)
        everything = await found(plant)
        assert everything == sorted(everything, key=lambda deed: deed.id, reverse=True)
        assert await found(plant, caller="kim") == [it for it in everything if it.caller == KIM.caller]
        assert await found(plant, target="3F") == [it for it in everything if it.target == "line1.3F"]
        assert await found(plant, target="line1") == everything
        assert await found(plant, target="line") == []
        now = datetime.now(UTC)
        assert await found(plant, since=now - timedelta(hours=1), until=now) == everything
        assert await found(plant, since=now) == []
        first = await found(plant, limit=1)
        assert [*first, *await found(plant, before=first[0].id)] == everything


@in_virtual_time
async def test_a_refusal_is_a_deed_too(tmp_path: Path) -> None:
    world = World(tmp_path / "data")
    async with world.gateway() as plant:
        await asyncio.sleep(SET_UP_S)
        assert isinstance(world.wire, Wire)
        axis = world.wire.machine.axes[0x3F]
        axis.world.forced.update({EMS: True})
        axis.sense(asyncio.get_running_loop().time())
        with pytest.raises(ControllerRefused):
            await do(plant, PAT, "/bodies/3F", MoveClockwise(distance=500))
        [deed] = await found(plant)
        assert deed.outcome == "refusal"


@in_virtual_time
async def test_without_a_journal_there_is_none() -> None:
    async with rig() as it:
        with pytest.raises(NotFound, match="no journal"):
            await found(it.plant)
