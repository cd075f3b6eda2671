"""A capture is armed in one piece: nothing but a stop comes between, and that is told."""

import asyncio

import pytest

from gateway.core.errors import PowerCycled
from gateway.core.journal.intents import Intents
from gateway.rorze.captures import NOTHING_YET, ArmingBrokenOff, CaptureRequest, arm, read, when_over
from protocols.rorze.moves import MoveClockwise
from tests.model_book import ModelBook
from tests.plants import in_virtual_time, rig, start

ONCE = CaptureRequest(edge="rising", position=25)


@in_virtual_time
async def test_a_move_of_somebody_else_waits_until_the_entries_are_marked() -> None:
    async with rig(baud=9600) as it:
        sent = len(it.wire.sent)
        arming = asyncio.create_task(arm(it.body(), 8, ONCE))
        await it.wire.begun("&3FCFS8,P:25")
        starting = asyncio.create_task(start(it, MoveClockwise(distance=500)))
        assert (await arming).captured is False
        await starting
        frames = it.wire.frames(sent)
        assert frames.index(f"&3F3PSP[25],{NOTHING_YET}") < frames.index("&3F1+M500")


@in_virtual_time
async def test_a_stop_breaks_it_off_and_says_what_is_left() -> None:
    async with rig(baud=9600) as it:
        arming = asyncio.create_task(arm(it.body(), 8, ONCE))
        await it.wire.begun("&3FCFS8,P:25")
        await it.plant.stops.stop([it.body()], "decelerate")
        with pytest.raises(ArmingBrokenOff, match="set up in part, then it was broken off: cancelled"):
            await arming
        assert (await read(it.body(), 8)).edge == "off"


@in_virtual_time
async def test_it_waits_for_the_disk_once() -> None:
    async with rig() as it:
        book, line = ModelBook(), it.body().line
        line.intents = Intents(book, line.address_of)
        sent = len(it.wire.sent)
        await arm(it.body(), 8, ONCE)
        frames = [str(intent["frame"]).rstrip() for _, intent in book.intents()]
        assert (book.waits, len(frames)) == (1, 7)
        assert [frame for frame in it.wire.frames(sent) if frame in frames] == frames


@in_virtual_time
async def test_what_a_body_holds_after_a_loss_of_power_was_not_captured() -> None:
    async with rig() as it:
        await arm(it.body(), 8, ONCE)
        waiting = asyncio.create_task(when_over(it.body(), 8, 10.0))
        await asyncio.sleep(1.0)
        it.machine.brown_out(0x3F, 0.02, asyncio.get_running_loop().time())
        with pytest.raises(PowerCycled, match="input 8 has captured nothing"):
            await waiting
