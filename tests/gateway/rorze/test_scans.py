"""Scans ask every body number, and find all that are there."""

import asyncio

import pytest

from gateway.core.errors import BodyBusy, NotFound, PortNotOpen
from protocols.rorze.position import GetPosition
from simulator.faults import Direction, Fault, Switch
from tests.plants import in_virtual_time, rig


@in_virtual_time
async def test_a_scan_finds_who_is_there_configured_or_not() -> None:
    async with rig(bodies=(0x00, 0x3F), present=(0x00, 0x12, 0x77), groups={}) as it:
        scan = it.plant.scans.start(it.plant.line("line1"))
        assert (scan.status, scan.line_id, scan.found) == ("running", "line1", [])
        await it.plant.scans.wait(scan, 300.0)
        assert (scan.status, scan.asked) == ("finished", 120)
        assert [(body.body_id, body.configured) for body in scan.found] == [
            ("line1.00", True),
            ("line1.12", False),
            ("line1.77", False),
        ]
        assert scan.ended_at is not None
        [event] = it.events("line.scan")
        assert (event.type, event.subject) == ("line.scan.finished", "/lines/line1")
        assert await it.plant.scans.get("line1", scan.id) is scan


@in_virtual_time
async def test_a_body_that_misses_the_first_round_is_found_in_the_second() -> None:
    async with rig(bodies=(0x00,), groups={}) as it:
        it.machine.faults.set(Switch(Fault.LOST, Direction.REPLIES, next_frames=1))
        scan = it.plant.scans.start(it.plant.line("line1"))
        await it.plant.scans.wait(scan, 300.0)
        assert [body.body_id for body in scan.found] == ["line1.00"]


@in_virtual_time
async def test_other_work_goes_on_during_a_scan() -> None:
    async with rig(baud=9600) as it:
        scan = it.plant.scans.start(it.plant.line("line1"))
        began_at = asyncio.get_running_loop().time()
        for _ in range(10):
            await it.body().ask(GetPosition())
        assert asyncio.get_running_loop().time() - began_at < 3.0
        assert scan.status == "running"
        await it.plant.scans.wait(scan, 300.0)


@in_virtual_time
async def test_bodies_that_are_not_there_do_not_disturb_those_that_are() -> None:
    async with rig() as it:
        scan = it.plant.scans.start(it.plant.line("line1"))
        await it.plant.scans.wait(scan, 300.0)
        assert it.plant.line("line1").state == "ready"
        assert all(body.online for body in it.plant.bodies())
        assert "body.offline" not in it.types()


@in_virtual_time
async def test_one_scan_of_a_line_at_a_time() -> None:
    async with rig() as it:
        line = it.plant.line("line1")
        scan = it.plant.scans.start(line)
        with pytest.raises(BodyBusy, match=scan.id):
            it.plant.scans.start(line)
        await it.plant.scans.wait(scan, 300.0)
        assert it.plant.scans.start(line).id != scan.id


@in_virtual_time
async def test_a_scan_of_a_line_that_is_down_is_refused_and_one_that_goes_down_fails() -> None:
    async with rig() as it:
        line = it.plant.line("line1")
        scan = it.plant.scans.start(line)
        await asyncio.sleep(1.0)
        it.wire.unplug()
        await it.plant.scans.wait(scan, 300.0)
        assert scan.status == "failed"
        assert scan.error is not None
        assert "line1" in scan.error
        with pytest.raises(PortNotOpen, match="pulled"):
            it.plant.scans.start(line)


@in_virtual_time
async def test_a_scan_that_nobody_knows() -> None:
    async with rig() as it:
        with pytest.raises(NotFound, match="no scan 4711"):
            await it.plant.scans.get("line1", "4711")
