"""Stored positions: read in parts whose answers are counted, because they come without their numbers."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import pytest

from gateway.core.errors import GarbledReply, GatewayError
from gateway.fics.errors import RobotBusy
from gateway.fics.units import PART
from protocols.fics.positions import LAST_POSITION
from simulator.faults import Direction, Fault, Switch
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time


def store(rig: FicsRig, last: int) -> list[tuple[int, list[float | None]]]:
    """Fill the table up to a number: position 7 has X at 70."""
    for number in range(1, last + 1):
        rig.fics.units[1].positions[number] = (10.0 * number, 0.0, 0.0)
    return [(number, [10.0 * number, 0.0, 0.0]) for number in range(1, last + 1)]


@contextmanager
def answered_wrongly(rig: FicsRig, answer: str, instead: int, times: int = 1) -> Iterator[None]:
    """Let an answer arrive `instead` of once, `times` times; 0 means that it is lost."""
    deliver, left = rig.cable._deliver, [times]

    def spoilt(data: bytes) -> None:
        lines = data.splitlines(keepends=True)
        for place, line in enumerate(lines):
            if line == answer.encode() + b"\r" and left[0]:
                left[0] -= 1
                lines[place] = line * instead
        if joined := b"".join(lines):
            deliver(joined)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rig.cable, "_deliver", spoilt)
        yield
    assert not left[0]


@pytest.mark.parametrize("last", [0, 1, 5, PART, PART + 1, 3 * PART])
def test_a_table_is_read_to_its_end(last: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig() as rig:
            stored = store(rig, last)
            assert await rig.robot.positions() == stored

    story()


@in_virtual_time
async def test_a_table_may_be_full() -> None:
    async with fics_rig() as rig:
        stored = store(rig, LAST_POSITION)
        assert await rig.robot.positions() == stored
        assert await rig.robot.positions(LAST_POSITION, LAST_POSITION) == stored[-1:]


@in_virtual_time
async def test_a_position_that_is_set_takes_one_question_and_one_that_is_not_takes_two() -> None:
    async with fics_rig() as rig:
        store(rig, 3)
        assert await rig.robot.unit(1).stored(2) == [20.0, 0.0, 0.0]
        assert await rig.robot.unit(1).stored(4) is None
        assert rig.heard("POR") == ["POR 2,1", "POR 4,1", "POR 4,1"]


@pytest.mark.parametrize("last", [0, PART])
def test_a_table_ends_too_where_the_robot_refuses_a_number_that_is_not_set(last: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig() as rig:
            stored = store(rig, last)
            deliver = rig.cable._deliver

            def refuse(data: bytes) -> None:
                deliver(b"POR E09\r" if data == b"POE\r" else data)

            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(rig.cable, "_deliver", refuse)
                assert await rig.robot.positions() == stored
                assert await rig.robot.unit(1).stored(last + 1) is None

    story()


@pytest.mark.parametrize("last", [3, 5, PART, PART + 4])
@pytest.mark.parametrize("spoilt", ["POS 10,0,0", "POS 20,0,0", "POS 30,0,0", "POE"])
@pytest.mark.parametrize("instead", [0, 2])
def test_an_answer_that_is_lost_or_doubled_renumbers_nothing(last: int, spoilt: str, instead: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig() as rig:
            stored = store(rig, last)
            with answered_wrongly(rig, spoilt, instead):
                assert await rig.robot.positions() == stored
            with answered_wrongly(rig, spoilt, instead):
                assert await rig.robot.positions(1, 3) == stored[:3]

    story()


@in_virtual_time
async def test_an_answer_lost_beside_a_doubled_one_renumbers_nothing() -> None:
    async with fics_rig() as rig:
        stored = store(rig, PART)
        with answered_wrongly(rig, "POS 20,0,0", 0), answered_wrongly(rig, "POS 30,0,0", 2):
            assert await rig.robot.positions() == stored


@in_virtual_time
async def test_positions_that_are_equal_are_read_twice() -> None:
    async with fics_rig() as rig:
        store(rig, 3)
        rig.fics.units[1].positions[2] = rig.fics.units[1].positions[1]
        assert [place[0] for _, place in await rig.robot.positions(1, 3)] == [10.0, 10.0, 30.0]
        assert rig.heard("POR") == ["POR 1,3", "POR 1,3"]


@pytest.mark.parametrize("seed", range(8))
def test_what_is_read_over_a_bad_line_is_true(seed: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(seed=seed) as rig:
            stored = store(rig, 2 * PART + 3)
            for fault in (Fault.LOST, Fault.DOUBLED):
                rig.machine.faults.set(Switch(fault, Direction.REPLIES, probability=0.01))
            read = 0
            for _ in range(20):
                with suppress(GatewayError):
                    assert await rig.robot.positions() == stored
                    read += 1
            assert read

    story()


@in_virtual_time
async def test_a_line_that_loses_an_answer_again_and_again_tells_no_table() -> None:
    async with fics_rig() as rig:
        store(rig, 5)
        with (
            answered_wrongly(rig, "POS 20,0,0", 0, times=6),
            pytest.raises(GarbledReply, match=r"units/1 from 1 on .* nobody knows their numbers"),
        ):
            await rig.robot.positions()


@in_virtual_time
async def test_f11_a_stop_waits_for_one_part_and_ends_the_reading() -> None:
    async with fics_rig(baud=9600) as rig:
        store(rig, LAST_POSITION)
        reading = asyncio.create_task(rig.robot.positions())
        await asyncio.sleep(1)
        report = await rig.robot.stop("immediate")
        assert report.state == "confirmed"
        with pytest.raises(RobotBusy, match="not all of its positions were read"):
            await reading
        asked = len(rig.heard("POR"))
        await asyncio.sleep(5)
        assert len(rig.heard("POR")) == asked


@in_virtual_time
async def test_others_are_heard_between_the_parts() -> None:
    async with fics_rig(baud=9600) as rig:
        store(rig, 20 * PART)
        reading = asyncio.create_task(rig.robot.positions())
        await asyncio.sleep(1)
        await rig.robot.unit(1).position()
        assert not reading.done()
        assert len(await reading) == 20 * PART
