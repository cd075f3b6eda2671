"""A shift on a page: what has moved, how it ended, and who asked, from the journal, over restarts."""

import asyncio
import csv
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from datetime import UTC, datetime, timedelta
from io import StringIO
from pathlib import Path
from typing import Any, Final

import pytest

from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.origin import Origin
from gateway.door.doing import do
from gateway.door.shifts import Shift, download_shift, get_shift
from gateway.door.stopping import stop_all
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.origin import Home
from protocols.rorze.speeds import SetMaximumSpeed
from simulator.rorze.world import EMS
from tests.plants import SET_UP_S, Wire, in_virtual_time, rig
from tests.tested_plant import TestedPlant
from tests.world import World

PAT: Final = Origin("pat (http 10.0.0.7)", "r-1")
KIM: Final = Origin("kim (http 10.0.0.8)", "r-2")
LONG_S: Final = 60.0


@asynccontextmanager
async def working(tmp_path: Path) -> AsyncIterator[tuple[TestedPlant, Wire]]:
    """A plant with a journal, set up."""
    world = World(tmp_path / "data")
    async with world.gateway() as plant:
        await asyncio.sleep(SET_UP_S)
        assert isinstance(world.wire, Wire)
        yield plant, world.wire


async def move(plant: TestedPlant, body: str, command: Any, by: Origin = PAT) -> None:
    await do(plant, by, f"/bodies/{body}", command, LONG_S)


async def of_shift(plant: TestedPlant, **wanted: Any) -> Shift:
    return await get_shift(plant, **wanted)


@in_virtual_time
async def test_it_counts_moves_and_how_they_ended_and_names_the_slowest(tmp_path: Path) -> None:
    async with working(tmp_path) as (plant, wire):
        await move(plant, "3F", MoveClockwise(distance=500))
        await move(plant, "3F", MoveClockwise(distance=5_000))
        await move(plant, "00", MoveClockwise(distance=100))
        await do(plant, KIM, "/bodies/00", SetMaximumSpeed(speed_set=None, speed=5_000))
        await do(plant, KIM, "/bodies/00", MoveClockwise(distance=900_000))
        wire.machine.axes[0].world.forced.update({EMS: True})
        wire.machine.axes[0].sense(asyncio.get_running_loop().time())
        await plant.moves.wait(plant.moves.log.of(plant.body("00").address)[0].id, LONG_S)

        shift = await of_shift(plant)
        assert shift.moves == 4
        assert shift.ends == {"succeeded": 3, "failed": 1}
        axes = {it.target: it for it in shift.axes}
        lift = axes["line1.3F"]
        assert (lift.moves, lift.succeeded, lift.failed) == (2, 2, 0)
        assert lift.longest_move in {it.id for it in plant.moves.log.of(plant.body("3F").address)}
        assert lift.longest_s is not None
        assert lift.mean_s is not None
        assert 0 < lift.mean_s <= lift.longest_s
        [failure] = shift.failures
        assert (failure.cause, failure.moves, failure.targets) == ("ems", 1, 1)
        assert failure.last_move == plant.moves.log.of(plant.body("00").address)[0].id
        people = {it.caller: it for it in shift.people}
        assert (people[PAT.caller].motions, people[PAT.caller].settings) == (3, 0)
        assert (people[KIM.caller].motions, people[KIM.caller].settings) == (1, 1)
        assert [(it.cause, it.raised) for it in shift.alarms if it.cause == "body.move.failed"] == [
            ("body.move.failed", 1)
        ]


@in_virtual_time
async def test_a_stop_of_all_is_one_stop(tmp_path: Path) -> None:
    async with working(tmp_path) as (plant, _):
        await stop_all(plant, KIM, "immediate")
        shift = await of_shift(plant)
        assert shift.stops == 1
        assert [(it.caller, it.stops) for it in shift.people] == [(KIM.caller, 1)]


@in_virtual_time
async def test_homings_that_find_another_origin_are_told(tmp_path: Path) -> None:
    async with working(tmp_path) as (plant, _):
        await move(plant, "3F", Home())
        await move(plant, "3F", MoveClockwise(distance=1_000))
        await move(plant, "3F", Home())
        [drift] = (await of_shift(plant)).homings
        assert (drift.target, drift.homings, drift.last_off_by) == ("line1.3F", 1, 0)


@in_virtual_time
async def test_a_loss_of_power_between_two_homings_leaves_nothing_to_compare(tmp_path: Path) -> None:
    async with working(tmp_path) as (plant, wire):
        await move(plant, "3F", Home())
        await do(plant, KIM, "/bodies/3F", MoveClockwise(distance=900_000))
        for on in (False, True):
            wire.machine.switch_body(0x3F, on=on, now=asyncio.get_running_loop().time())
            await asyncio.sleep(30.0)
        assert plant.body("3F").power.cycled
        await move(plant, "3F", Home())
        shift = await get_shift(plant)
        assert shift.homings == []
        assert [(failure.cause, failure.moves) for failure in shift.failures] == [("lost", 1)]


@in_virtual_time
async def test_it_is_of_its_time_and_its_target_and_stays_over_a_restart(tmp_path: Path) -> None:
    world = World(tmp_path / "data")
    async with world.gateway() as plant:
        await asyncio.sleep(SET_UP_S)
        await move(plant, "3F", MoveClockwise(distance=500))
        await move(plant, "00", MoveClockwise(distance=500))
    async with world.gateway() as plant:
        assert (await of_shift(plant)).moves == 2
        assert (await of_shift(plant, target="3F")).moves == 1
        assert (await of_shift(plant, target="line1")).moves == 2
        end = datetime.now(UTC) + timedelta(hours=9)
        later = await of_shift(plant, until=end)
        assert (later.moves, later.since) == (0, end - timedelta(hours=8))
        assert later.known_since is not None
        assert later.known_since < later.since


@in_virtual_time
async def test_its_axes_are_a_table_for_others(tmp_path: Path) -> None:
    async with working(tmp_path) as (plant, _):
        await move(plant, "3F", MoveClockwise(distance=500))
        text = await download_shift(plant)
        [row] = csv.DictReader(StringIO(text.content))
        assert (row["target"], row["moves"], row["homings"]) == ("line1.3F", "1", "")


@in_virtual_time
async def test_a_time_that_is_none_is_refused(tmp_path: Path) -> None:
    now = datetime.now(UTC)
    async with working(tmp_path) as (plant, _):
        first, last = (it.replace(tzinfo=UTC) for it in (datetime.min, datetime.max))
        wrong = (
            (now, now - timedelta(hours=1)),
            (now - timedelta(days=40), now),
            (None, first),
            (last - timedelta(days=40), last),
        )
        for since, until in wrong:
            with pytest.raises(InvalidRequest, match="within 31 days"):
                await get_shift(plant, since=since, until=until)


@in_virtual_time
async def test_without_a_journal_nobody_knows() -> None:
    async with rig() as it:
        with pytest.raises(NotFound, match="no journal"):
            await get_shift(it.plant)
