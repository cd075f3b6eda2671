"""Uploads of position tables: followed, cancelled, and told how much of them was sent."""

import asyncio
from collections.abc import Sequence
from functools import partial

import pytest

from gateway.core.errors import BodyBusy, InvalidRequest
from gateway.rorze.door.positions import named
from gateway.rorze.positions import NamedPosition, TablePosition, TableUpload, WantedPosition, read
from protocols.rorze.position import GetPosition
from tests.plants import Rig, in_virtual_time, rig
from tests.watching import watching

COUNT = 40
TABLE = [WantedPosition(number, number + 1) for number in range(COUNT)]
WHOLE = 1e6


def begin(running: Rig, wanted: Sequence[WantedPosition] = TABLE) -> TableUpload:
    async def name_all(held: Sequence[TablePosition]) -> list[NamedPosition]:
        return list(map(partial(named, running.plant, running.body()), held))

    return running.plant.rorze.position_uploads.start(running.body(), wanted, flash=False, named=name_all)


@in_virtual_time
async def test_progress_is_told_once_a_second_and_the_end_at_once() -> None:
    async with rig(baud=9600) as it, watching(it.plant.events, bodies=["3F"]) as watcher:
        record = begin(it)
        await it.plant.rorze.position_uploads.wait(record, WHOLE)
        told = [event["data"] for event in watcher.of("body.position_upload.progress")]
        assert len(watcher.of("body.position_upload.succeeded")) == 1
    assert (record.status, record.read, record.expected) == ("succeeded", 2 * COUNT, 2 * COUNT)
    assert record.positions is not None
    assert [(place.number, place.pulses) for place in record.positions] == [(n, n + 1) for n in range(COUNT)]
    assert 3 <= len(told) <= 8
    assert [progress["read"] for progress in told] == sorted({progress["read"] for progress in told})


@in_virtual_time
@pytest.mark.parametrize("after_s", [0.0, 0.5, 2.0])
async def test_one_that_is_cancelled_says_how_much_was_sent(after_s: float) -> None:
    async with rig(baud=9600) as it:
        record = begin(it)
        await asyncio.sleep(after_s)
        await it.plant.rorze.position_uploads.cancel(record.target)
        assert (record.status, record.positions) == ("cancelled", None)
        assert record.error is not None
        assert f"{record.read} of {COUNT} positions were sent, perhaps one more" in record.error.detail
        held = sum(place.pulses > 0 for place in await read(it.body(), 0, COUNT - 1))
    assert record.read <= held <= record.read + 1


@in_virtual_time
async def test_one_that_is_cancelled_while_it_is_read_back_was_sent_whole() -> None:
    async with rig(baud=9600) as it:
        record = begin(it)
        while record.read < COUNT + 5:
            await it.plant.rorze.position_uploads.wait(record, 0.1)
        await it.plant.rorze.position_uploads.cancel(record.target)
        assert record.error is not None
        assert f"all {COUNT} positions were sent, and not all of them read back" in record.error.detail


@in_virtual_time
async def test_one_at_a_time_and_only_what_can_be_stored() -> None:
    async with rig(baud=9600) as it:
        with pytest.raises(InvalidRequest, match="given twice"):
            begin(it, [WantedPosition(1, 1), WantedPosition(1, 2)])
        begin(it)
        with pytest.raises(BodyBusy, match="is being stored; nothing was sent"):
            begin(it)


@in_virtual_time
async def test_one_whose_body_falls_silent_has_failed_with_how_much_was_sent() -> None:
    async with rig(baud=9600) as it:
        record = begin(it)
        await asyncio.sleep(1)
        it.machine.switch_body(0x3F, on=False, now=asyncio.get_running_loop().time())
        await it.plant.rorze.position_uploads.wait(record, WHOLE)
        alarms = {alarm.cause for alarm in it.plant.alarms.standing()}
    assert record.status == "failed"
    assert "body.position_upload.failed" in alarms
    assert record.error is not None
    assert f"{record.read} of {COUNT} positions were sent" in record.error.detail


@in_virtual_time
async def test_the_wire_has_no_rest_and_others_are_served_meanwhile() -> None:
    async with rig(baud=9600) as it:
        now, taken = asyncio.get_running_loop().time, []
        await asyncio.sleep(2.0)
        sent, began = len(it.wire.sent), now()
        record = begin(it)
        while record.status == "running":
            asked = now()
            await it.body().ask(GetPosition())
            taken.append(now() - asked)
            await it.plant.rorze.position_uploads.wait(record, 0.2)
        took_s = now() - began
        busy = sum(len(frame) + 1 for frame in it.wire.frames(sent))
        busy += sum(len(data) for at, data in it.wire.heard if at >= began)
        assert max(taken) < 0.25
        assert busy * it.wire.byte_time_s >= 0.95 * took_s
