"""A link master may answer @4C for a body that is not there: that is no sign of it (decision 61)."""

import asyncio

import pytest

from gateway.core.errors import BodyOffline, ControllerRefused
from gateway.core.move_record import MoveStatus
from protocols.rorze.flash import SaveSettings
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from simulator.rorze.breakdowns import Breakdown
from simulator.rorze.rc400 import LinkSettings
from tests.gateway.rorze.full_line import SWEEP_GROUPS
from tests.gateway.rorze.test_body_power import now
from tests.plants import Rig, in_virtual_time, rig, start

ANSWERS_FOR_THE_ABSENT = LinkSettings(absent_bodies="error")
LONG = MoveClockwise(distance=900_000)
NOTICED_S = 6.0


def switch(rig: Rig, number: int, *, on: bool) -> None:
    rig.machine.switch_body(number, on=on, now=now())
    rig.wire.turn()


@in_virtual_time
async def test_a_body_that_was_pulled_is_offline_and_found_again_without_its_power() -> None:
    async with rig(settings=ANSWERS_FOR_THE_ABSENT) as it:
        switch(it, 0x01, on=False)
        await asyncio.sleep(NOTICED_S)
        assert [body.online for body in it.plant.bodies()] == [True, False, True]
        with pytest.raises(BodyOffline):
            await start(it, LONG, "01")
        assert it.plant.line("line1").state == "ready"
        assert it.plant.line("line1").counters["strays"] == 0
        switch(it, 0x01, on=True)
        await asyncio.sleep(NOTICED_S)
        assert it.types("body.o") == ["body.offline", "body.online"]
        assert it.body("01").power.cycled


@in_virtual_time
async def test_a_motor_that_loses_its_power_on_the_way_is_lost_and_a_stop_of_it_not_confirmed() -> None:
    async with rig(settings=ANSWERS_FOR_THE_ABSENT) as it:
        move = await start(it, LONG, "01")
        switch(it, 0x01, on=False)
        await it.plant.moves.wait(move.id, 60.0)
        assert (move.status, it.body("01").online) == (MoveStatus.LOST, False)
        [report] = await it.plant.stops.stop([it.body("01")], "immediate")
        assert report.state != "confirmed"
        assert "hardware stop" in str(report.detail)
        assert not it.body("01").online


@in_virtual_time
async def test_an_absent_member_of_a_group_for_sweeps_is_found_out() -> None:
    async with rig(
        bodies=range(30), groups={}, baud=9600, options=SWEEP_GROUPS, settings=ANSWERS_FOR_THE_ABSENT
    ) as it:
        await asyncio.sleep(60.0)
        switch(it, 0x05, on=False)
        sweep = it.plant.rorze.sweep_of(it.plant.rorze.lines["line1"])
        bodies = it.plant.bodies()
        for _ in range(2):
            told = await sweep.ask(bodies, GetPosition())
            await asyncio.sleep(NOTICED_S)
        assert isinstance(told[bodies[5]], ControllerRefused | BodyOffline)
        assert [body.short for body in bodies if not body.online] == ["05"]


@pytest.mark.prove
@in_virtual_time
async def test_a_body_that_refuses_so_for_a_moment_or_once_an_hour_stays_online() -> None:
    async with rig() as it:
        for _ in range(3):
            it.axis().breakdown = Breakdown(0x4C, 1)
            await asyncio.sleep(3600.0)
        assert it.types("body.offline") == []


@in_virtual_time
async def test_a_body_is_busy_with_its_flash_memory_and_still_there() -> None:
    async with rig() as it:
        await it.body().ask(SaveSettings())
        assert it.types("body.offline") == []


@in_virtual_time
async def test_that_a_body_cannot_be_read_is_told_once() -> None:
    async with rig() as it:
        it.axis().breakdown = Breakdown(0x4E, 1_000_000)
        await asyncio.sleep(60.0)
        assert it.types("body.unreadable") == ["body.unreadable"]
        it.axis().breakdown = Breakdown()
        await asyncio.sleep(NOTICED_S)
        it.axis().breakdown = Breakdown(0x4E, 1_000_000)
        await asyncio.sleep(60.0)
        assert it.types("body.unreadable") == ["body.unreadable"] * 2
