"""Commissioning beside the gateway: the port is lent to questions, and taken back for a stop."""

import asyncio
from typing import Any

import pytest

from commissioning.run import ask_only
from gateway.commissionings import CANCELLED, STOPPED
from gateway.core.errors import BodyBusy, NotSent, PortNotOpen
from gateway.core.origin import Origin
from gateway.door import stopping
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from protocols.rorze.row import LINK_MASTER
from simulator.rorze.rc400 import LinkSettings
from tests.plants import Rig, in_virtual_time, rig, start

BACK_S = 5.0
"""More than a line needs to be ready again."""


async def begun(running: Rig) -> str:
    """Begin to commission the first line, and let it get to its questions."""
    running.plant.works.commissionings.walk = ask_only
    record = running.plant.commission("line1")
    await asyncio.sleep(0.1)
    return record.id


@in_virtual_time
async def test_a_line_is_commissioned_and_serves_again() -> None:
    async with rig() as running:
        record_id = await begun(running)
        record = running.plant.works.commissionings.find("line1", record_id)
        assert record is not None
        assert record.status == "running"
        assert running.plant.port("line1").state == "down"
        with pytest.raises(PortNotOpen, match="commissioned"):
            await running.body().ask(GetPosition())
        await running.plant.works.commissionings.wait(record, 60.0)
        assert (record.status, record.error, record.doing) == ("finished", None, None)
        report: Any = record.report
        assert {it["result"] for it in report["results"]} == {"agrees", "cannot_tell"}
        await asyncio.sleep(BACK_S)
        assert running.plant.port("line1").state == "ready"
        assert (await running.body().ask(GetPosition()))[0].pulses == 0


@in_virtual_time
async def test_a_stop_takes_the_port_back_at_once() -> None:
    async with rig() as running:
        record_id = await begun(running)
        begun_at, sent = asyncio.get_running_loop().time(), len(running.wire.sent)
        stop = asyncio.create_task(stopping.stop_all(running.plant, Origin("test"), "decelerate"))
        record = await running.plant.works.commissionings.get("line1", record_id, 10.0)
        assert (record.status, record.error) == ("cancelled", STOPPED)
        assert asyncio.get_running_loop().time() - begun_at < 0.1
        assert (await stop).confirmed
        await asyncio.sleep(BACK_S)
        stops = [it for it in running.wire.sent[sent:] if it.frame.endswith(("5SS", "5IS"))]
        assert {it.frame[:3] for it in stops} == {"&00", "&01", "&3F"}


@in_virtual_time
async def test_it_is_cancelled_by_request_and_at_the_end_of_the_gateway() -> None:
    async with rig() as running:
        record_id = await begun(running)
        record = running.plant.works.commissionings.find("line1", record_id)
        assert record is not None
        running.plant.works.commissionings.break_off(record)
        await running.plant.works.commissionings.wait(record, 10.0)
        assert (record.status, record.error) == ("cancelled", CANCELLED)
        await asyncio.sleep(BACK_S)
        assert running.plant.port("line1").state == "ready"
        running.plant.commission("line1")
    assert [it.status for it in running.plant.works.commissionings.under_way()] == []


@in_virtual_time
async def test_while_something_moves_no_port_is_lent() -> None:
    async with rig() as running:
        running.plant.works.commissionings.walk = ask_only
        await start(running, MoveClockwise(distance=100_000))
        with pytest.raises(BodyBusy, match="moves or is at work; nothing was sent"):
            running.plant.commission("line1")


@in_virtual_time
async def test_it_goes_on_once_and_not_where_it_is_not_known() -> None:
    async with rig() as running:
        with pytest.raises(NotSent):
            running.plant.commission("line1")
        await begun(running)
        with pytest.raises(BodyBusy):
            running.plant.commission("line1")


@in_virtual_time
async def test_what_is_found_on_a_line_that_is_otherwise_is_in_the_record() -> None:
    async with rig(settings=LinkSettings(reply_delay_s=0.4)) as running:
        record_id = await begun(running)
        record = await running.plant.works.commissionings.get("line1", record_id, 200.0)
        report: Any = record.report
        settings = [it["setting"] for it in report["results"]]
        assert {"key": "reply_timeout_s", "now": 0.5, "proposed": 1.2} in settings
        traced = running.plant.history.recorders["line1"].entries()
        assert any(f"&{LINK_MASTER:02X}XID".encode() in it.data for it in traced)
