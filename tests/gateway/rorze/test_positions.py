"""The position table: read by number, stored, and believed only when it was read back."""

import asyncio
from contextlib import suppress
from random import Random

import pytest

from gateway.core.errors import BodyBusy, GatewayError, InvalidRequest
from gateway.rorze.bodies import Body
from gateway.rorze.positions import (
    LAST_POSITION,
    PositionsDiffer,
    StoringBrokenOff,
    TablePosition,
    WantedPosition,
    read,
    store,
)
from protocols.rorze.flash import LoadPositions
from protocols.rorze.moves import MoveClockwise, MoveTo
from protocols.rorze.notation import BILLION, PositionReference
from protocols.rorze.position import GetPosition
from simulator.faults import Direction, Fault, Switch
from tests.plants import finished, in_virtual_time, lose, rig, start


@in_virtual_time
async def test_positions_are_stored_and_read_back() -> None:
    async with rig() as it:
        held = await store(
            it.body(), [WantedPosition(7, 500), WantedPosition(2047, -999_999_999), WantedPosition(0, 0)]
        )
        assert held == [TablePosition(7, 500), TablePosition(2047, -999_999_999), TablePosition(0, 0)]
        assert await read(it.body(), 6, 8) == [
            TablePosition(6, 0),
            TablePosition(7, 500),
            TablePosition(8, 0),
        ]


@in_virtual_time
async def test_a_number_alone_stores_where_the_motor_stands() -> None:
    async with rig() as it:
        await finished(it, MoveClockwise(distance=1_234))
        assert await store(it.body(), [WantedPosition(7, None)]) == [TablePosition(7, 1_234)]
        await start(it, MoveClockwise(distance=100_000))
        with pytest.raises(BodyBusy, match="moves; nothing was sent"):
            await store(it.body(), [WantedPosition(8, None)])
        assert (await store(it.body(), [WantedPosition(9, 5)])) == [TablePosition(9, 5)]


@in_virtual_time
async def test_what_cannot_be_stored_is_not_sent() -> None:
    async with rig() as it:
        before = len(it.wire.sent)
        for wanted, told in (
            ([WantedPosition(1, 5), WantedPosition(1, 6)], "given twice"),
            ([WantedPosition(LAST_POSITION + 1, 5)], "no position 2048"),
            ([WantedPosition(1, 10**9)], "less than 1000000000"),
        ):
            with pytest.raises(InvalidRequest, match=told):
                await store(it.body(), wanted)
        with pytest.raises(InvalidRequest, match="less than first"):
            await read(it.body(), 5, 4)
        assert not [frame for frame in it.wire.frames(before) if frame[3:5] in ("3P", "3N")]


@in_virtual_time
async def test_what_the_body_holds_otherwise_is_told() -> None:
    async with rig() as it:
        storing = asyncio.create_task(store(it.body(), [WantedPosition(1, 5), WantedPosition(2, 6)]))
        for _ in range(3):  # somebody else writes there, too
            await it.wire.begun("&3F3NDP[2]")
            it.axis().positions[2] = 7
        with pytest.raises(PositionsDiffer, match="under the numbers 2"):
            await storing


@in_virtual_time
async def test_a_line_that_goes_down_breaks_it_off_and_says_what_was_sent() -> None:
    async with rig() as it:
        storing = asyncio.create_task(store(it.body(), [WantedPosition(number, 5) for number in range(4)]))
        await it.wire.begun("&3F3PSP[2],5")
        it.wire.unplug()
        with pytest.raises(StoringBrokenOff, match="2 of 4 positions were sent"):
            await storing


@in_virtual_time
async def test_flash_holds_what_was_stored() -> None:
    async with rig() as it:
        await store(it.body(), [WantedPosition(3, 33)], flash=True)
        await store(it.body(), [WantedPosition(3, 44)])
        await it.body().ask(LoadPositions())
        assert await read(it.body(), 3, 3) == [TablePosition(3, 33)]


@in_virtual_time
async def test_a_lost_answer_costs_a_repetition_and_no_position() -> None:
    async with rig() as it:
        reading = asyncio.create_task(read(it.body(), 0, 20))
        await it.wire.begun("&3F3NDP[5]")
        lose(it, Direction.REPLIES, 1)
        assert [found.number for found in await reading] == list(range(21))


@in_virtual_time
async def test_a_move_goes_to_a_stored_position() -> None:
    async with rig() as it:
        await store(it.body(), [WantedPosition(5, 800)])
        move = await finished(it, MoveTo(position=PositionReference(position=5)))
        assert (move.frame, move.target_position, move.position) == ("&3F1AMP[5]\\r", 800, 800)


async def _asked_s(body: Body) -> float:
    began = asyncio.get_running_loop().time()
    await body.ask(GetPosition())
    return asyncio.get_running_loop().time() - began


@in_virtual_time
async def test_reading_all_of_it_keeps_the_wire_busy_and_lets_others_through() -> None:
    async with rig(baud=9600) as it:
        loop = asyncio.get_running_loop()
        began, sent, heard = loop.time(), len(it.wire.sent), len(it.wire.heard)
        reading = asyncio.create_task(read(it.body(), 0, LAST_POSITION))
        slowest = 0.0
        for _ in range(40):
            await asyncio.sleep(1.0)
            slowest = max(slowest, await _asked_s(it.body()), await _asked_s(it.body("00")))
        assert len(await reading) == LAST_POSITION + 1
        took = loop.time() - began
        told = sum(len(data) for _, data in it.wire.heard[heard:])
        asked = sum(len(frame) + 1 for frame in it.wire.frames(sent))
        assert (told + asked) * 10 / 9600 >= 0.95 * took
        assert slowest < 0.25


def test_on_lines_that_err_no_position_is_called_stored_that_is_not() -> None:
    stored = 0

    @in_virtual_time
    async def story(seed: int) -> None:
        nonlocal stored
        dice = Random(seed)
        async with rig(seed=seed) as it:
            for fault in (Fault.LOST, Fault.GARBLED, Fault.NOISE, Fault.LATE, Fault.DOUBLED):
                for direction in Direction:
                    chance = dice.choice([0.0, 0.01, 0.04])
                    it.machine.faults.set(Switch(fault, direction, probability=chance, delay_s=0.3))
            numbers = dice.sample(range(2048), 20)
            wanted = [WantedPosition(number, dice.randrange(1 - BILLION, BILLION)) for number in numbers]
            with suppress(GatewayError):
                held = await store(it.body(), wanted)
                assert [*map(tuple, held)] == [*map(tuple, wanted)]
                assert all(it.axis().positions[number] == pulses for number, pulses in wanted)
                stored += 1

    for seed in range(40):
        story(seed)
    assert stored >= 20, stored
