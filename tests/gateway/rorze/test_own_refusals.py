"""The gateway leaves no command error behind that its own questions have set, and clears nobody else's."""

import asyncio

from gateway.core.lanes import Lane
from gateway.rorze.backup import text_of
from gateway.rorze.jogs import BodyJogRequest
from gateway.rorze.limited_speed import Rate
from gateway.rorze.own_refusals import COMMAND_ERROR
from gateway.rorze.patterns import read_patterns
from protocols.rorze.status import GetControllerStatus
from simulator.rorze.world import EMS
from tests.plants import Rig, in_virtual_time, rig


async def status(it: Rig) -> int:
    return (await it.body().ask(GetControllerStatus()))[0].bits or 0


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
        await read_patterns(it.body(), range(3))
        assert await status(it) == 0


@in_virtual_time
async def test_the_first_slow_jog_leaves_none() -> None:
    async with rig() as it:
        await known(it)
        request = BodyJogRequest(direction="cw", speed="high", max_speed=Rate(value=500, unit="pulse/s"))
        jog = await it.plant.rorze.jogs.start(it.body(), request)
        await it.plant.rorze.jogs.end(it.body(), jog.id)
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
        await read_patterns(it.body(), range(3))
        assert await status(it) & 0b100


@in_virtual_time
async def test_a_command_error_that_stood_before_stays() -> None:
    async with rig() as it:
        await read_patterns(it.body(), [3])
        it.touch(0x3F, lambda axis: setattr(axis, "status", axis.status | COMMAND_ERROR))
        await known(it)
        await read_patterns(it.body(), range(3))
        assert await status(it) & COMMAND_ERROR
