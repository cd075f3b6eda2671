"""The plant as it was at a moment: places on the way, what did not answer, alarms, over restarts."""

import asyncio
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from gateway.core.errors import NotFound
from gateway.door.doing import do
from gateway.door.moments import Moment, get_moment
from protocols.rorze.moves import MoveClockwise
from simulator.rorze.world import EMS
from tests.gateway.door.test_shifts import KIM, LONG_S, working
from tests.gateway.door.test_shifts import move as start
from tests.plants import SET_UP_S, in_virtual_time, rig
from tests.world import World

AT_NOON = datetime(2026, 11, 28, 12, 0, tzinfo=UTC)


def place(moment: Moment, target: str = "line1.3F") -> tuple[str, object]:
    [found] = [it for it in moment.places if it.target == target]
    return found.state, found.position


@in_virtual_time
async def test_a_motor_is_on_its_way_in_the_middle_of_its_move(tmp_path: Path) -> None:
    async with working(tmp_path) as (plant, _):
        await start(plant, "3F", MoveClockwise(distance=50_000))
        [move] = plant.moves.log.of(plant.body("3F").address)
        assert move.sent_at is not None
        assert move.ended_at is not None
        assert place(await get_moment(plant, at=move.created_at)) == ("standing", move.start_position)
        assert place(await get_moment(plant, at=move.ended_at)) == ("standing", move.position)
        middle = move.sent_at + (move.ended_at - move.sent_at) / 2
        state, position = place(await get_moment(plant, at=middle))
        assert state == "moving"
        a_turn_of_the_loop = 50
        assert position == pytest.approx((move.start_position or 0) + 25_000, abs=a_turn_of_the_loop)
        assert (await get_moment(plant, at=move.created_at - timedelta(days=1))).places == []


@in_virtual_time
async def test_an_alarm_stands_from_its_begin_until_it_is_reset(tmp_path: Path) -> None:
    async with working(tmp_path) as (plant, wire):
        quiet_at = datetime.now(UTC)
        await do(plant, KIM, "/bodies/00", MoveClockwise(distance=900_000))
        wire.machine.axes[0].world.forced.update({EMS: True})
        wire.machine.axes[0].sense(asyncio.get_running_loop().time())
        await plant.moves.wait(plant.moves.log.of(plant.body("00").address)[0].id, LONG_S)
        await asyncio.sleep(5.0)
        [alarm, *_] = plant.alarms.standing()
        raised = await get_moment(plant, at=alarm.raised_at)
        assert alarm.id in [it.id for it in raised.alarms]
        assert (await get_moment(plant, at=quiet_at)).alarms == []


@in_virtual_time
async def test_what_did_not_answer_then_is_named_over_a_restart(tmp_path: Path) -> None:
    world = World(tmp_path / "data")
    async with world.gateway():
        await asyncio.sleep(SET_UP_S)
        world.wire.unplug()
        await asyncio.sleep(30.0)
        lost_at = datetime.now(UTC)
    world.wire.plugged_in = True
    async with world.gateway() as plant:
        await asyncio.sleep(10.0)
        assert "line1" in (await get_moment(plant, at=lost_at)).unreached
        assert (await get_moment(plant)).unreached == []


@in_virtual_time
async def test_without_a_journal_nobody_knows() -> None:
    async with rig() as it:
        with pytest.raises(NotFound, match="no journal"):
            await get_moment(it.plant, at=AT_NOON)
