"""The gateway clears each command error that its own questions have set, and no other."""

import asyncio
from typing import Any

import pytest

from gateway.core.errors import ControllerRefused, InvalidRequest
from gateway.core.exchange import Lane
from gateway.core.operation import Run
from gateway.door.calls import carry_out
from gateway.rorze import curves, patterns, settings
from gateway.rorze.backup import text_of
from gateway.rorze.curves import get_curve
from gateway.rorze.knowledge import COMMAND_ERROR
from gateway.rorze.move_requests import BodyJogRequest
from gateway.rorze.patterns import PatternChange, PatternValues, alter_pattern, get_pattern, list_patterns
from gateway.rorze.plans import PlannedMove, Rate
from gateway.rorze.settings_table import BodySettingsChange
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.patterns import GetPattern
from protocols.rorze.status import ClearControllerStatus, GetControllerStatus
from simulator.rorze.world import EMS
from tests.plants import Rig, in_virtual_time, rig


async def status(it: Rig) -> int:
    return (await it.body().ask(GetControllerStatus()))[0].bits or 0


async def got(it: Rig, read: Run, **query: Any) -> Any:
    """The answer of a row to a caller without a scope, for pattern 20 or its list."""
    (row,) = (row for row in (*patterns.ROWS, *curves.ROWS, *settings.ROWS) if row.run is read)
    return await carry_out(it.plant, row, {"body_id": "3F", "n": 20} | query)


async def known(it: Rig) -> None:
    await it.body().poll(Lane.READ)


@in_virtual_time
async def test_a_backup_leaves_no_command_error() -> None:
    async with rig(baud=115200) as it:
        await known(it)
        await text_of(it.body())
        assert await status(it) == 0


@in_virtual_time
async def test_patterns_that_were_never_set_leave_none_when_they_are_looked_at() -> None:
    async with rig() as it:
        await known(it)
        await got(it, list_patterns, last=2)
        assert await status(it) == 0


@in_virtual_time
async def test_the_first_slow_jog_leaves_none() -> None:
    async with rig() as it:
        await known(it)
        request = BodyJogRequest(direction="cw", speed="high", max_speed=Rate(value=500, unit="pulse/s"))
        jog = await it.plant.rorze.jogs.start(it.body(), request)
        await it.plant.rorze.jogs.end(jog.id, it.body())
        assert await status(it) & COMMAND_ERROR == 0


@in_virtual_time
async def test_another_error_is_not_cleared_with_it() -> None:
    async with rig() as it:
        begun = asyncio.create_task(it.plant.rorze.jogs.start(it.body(), BodyJogRequest(direction="cw")))
        await begun
        it.touch(0x3F, lambda axis: axis.world.forced.update({EMS: True}))
        await asyncio.sleep(1)
        it.touch(0x3F, lambda axis: axis.world.forced.update({EMS: False}))
        await asyncio.sleep(1)
        await known(it)
        await got(it, list_patterns, last=2)
        assert await status(it) & 0b100


@in_virtual_time
async def test_a_command_error_that_stood_before_stays() -> None:
    async with rig() as it:
        await got(it, get_pattern)
        it.touch(0x3F, lambda axis: setattr(axis, "status", axis.status | COMMAND_ERROR))
        await known(it)
        await got(it, list_patterns, last=2)
        assert await status(it) & COMMAND_ERROR


@in_virtual_time
async def test_one_pattern_that_was_never_set_leaves_none_when_it_is_got() -> None:
    async with rig() as it:
        await known(it)
        await got(it, get_pattern)
        assert await status(it) == 0


@in_virtual_time
async def test_a_curve_that_is_refused_leaves_none() -> None:
    async with rig() as it:
        await known(it)
        with pytest.raises(InvalidRequest):
            await got(it, get_curve, distance=100)
        assert await status(it) == 0


@in_virtual_time
async def test_a_pattern_that_cannot_be_set_leaves_none() -> None:
    async with rig() as it:
        await known(it)
        with pytest.raises(InvalidRequest):
            await alter_pattern(it.body(), 20, PatternChange(acceleration_set=1), None, flash=False)
        assert await status(it) == 0


@in_virtual_time
async def test_the_plan_of_a_move_that_would_be_refused_leaves_none() -> None:
    async with rig() as it:
        await known(it)
        target = it.plant.target("/bodies/line1.3F")
        plan = await target.plan(MoveClockwise(distance=10, pattern=20))
        assert isinstance(plan, PlannedMove)
        assert "would be refused" in (plan.note or "")
        assert await status(it) == 0


@in_virtual_time
async def test_the_plan_of_a_groups_move_that_would_be_refused_leaves_none() -> None:
    async with rig(groups={"80": ("00", "3F")}) as it:
        await known(it)
        await it.plant.target("/groups/line1.80").plan(MoveClockwise(distance=10, pattern=20))
        assert await status(it) == 0


@in_virtual_time
async def test_a_value_that_cannot_be_read_and_is_set_leaves_none() -> None:
    async with rig() as it:
        await known(it)
        sets = PatternValues(acceleration_set=1, deceleration_set=1)
        await got(it, patterns.set_pattern, values=sets)
        assert await status(it) == 0
        for text in ("3IS2047", "3PDP[+]"):
            assert not it.axis(0x3F).execute(text, asyncio.get_running_loop().time()).payload.startswith("@")
        await got(it, settings.change_body_settings, change=BodySettingsChange(position_index=3))
        assert await status(it) == 0


@in_virtual_time
async def test_two_who_look_at_once_leave_none() -> None:
    async with rig() as it:
        await known(it)
        await asyncio.gather(got(it, get_pattern), got(it, list_patterns))
        assert await status(it) == 0


@in_virtual_time
async def test_what_a_caller_has_cleared_is_known_to_be_clear() -> None:
    async with rig() as it:
        target = it.plant.target("/bodies/line1.3F")
        with pytest.raises(ControllerRefused):
            await target.ask(GetPattern(pattern=20))
        await known(it)
        await target.ask(ClearControllerStatus())
        await text_of(it.body())
        assert await status(it) == 0


@in_virtual_time
async def test_the_command_error_of_a_callers_command_that_nobody_has_read_yet_stays() -> None:
    async with rig() as it:
        await known(it)
        with pytest.raises(ControllerRefused):
            await it.plant.target("/bodies/line1.3F").ask(GetPattern(pattern=20))
        await got(it, get_pattern)
        assert await status(it) & COMMAND_ERROR
