"""Counters of a plant: ends of moves by line, and the time of stops."""

import asyncio

from gateway.core.origin import Origin
from gateway.door.stopping import stop
from protocols.fics.homing import HomeRobot
from protocols.rorze.moves import MoveClockwise
from tests.fics_plants import fics_rig
from tests.plants import ended, finished, in_virtual_time, rig, start

ME = Origin("test")


@in_virtual_time
async def test_each_end_of_a_move_counts_for_its_line() -> None:
    async with rig(lines=("line1", "line2"), groups={}) as it:
        await finished(it, MoveClockwise(distance=500), "line2.3F")
        assert dict(it.plant.history.figures.moves) == {("line2", "succeeded"): 1}


@in_virtual_time
async def test_a_move_of_a_robot_counts_for_the_line_that_leads_to_it() -> None:
    async with fics_rig() as it:
        await it.move(HomeRobot())
        assert dict(it.plant.history.figures.moves) == {(it.robot.line.id, "succeeded"): 1}


@in_virtual_time
async def test_a_stop_lasts_from_its_request_to_the_standstill() -> None:
    async with rig() as it:
        move = await start(it, MoveClockwise(distance=50_000))
        await asyncio.sleep(0.5)
        asked_at = asyncio.get_running_loop().time()
        await stop(it.plant, ME, "/bodies/3F", "decelerate")
        took_s = asyncio.get_running_loop().time() - asked_at
        await ended(it, move)
        stops = it.plant.history.figures.stops["line1"]
        assert stops.up_to()[-1][1] == 1
        assert 0 < stops.total_s <= took_s
        assert it.plant.history.figures.moves["line1", "stopped"] == 1
