"""A table of positions counts as stored, or cleared, only where the robot tells so."""

import asyncio

import pytest

from gateway.core.errors import NoReply
from gateway.core.move_record import MoveStatus
from gateway.fics.errors import NotDone, NotReadBack, RobotBusy, RobotPositionsDiffer
from gateway.fics.tables import agrees
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveToPosition
from protocols.fics.positions import ClearPositions, StoredPosition, UploadPosition
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time

BOTH_MODES = pytest.mark.parametrize("mode", [2, 3])
ROW = [(number, [100.0 + 10 * number, 150.0]) for number in range(1, 6)]


async def upload_without(rig: FicsRig, lost: str) -> RobotPositionsDiffer:
    """Upload positions of which one line is lost; in Ver.3 a copy of the answer before stands for its own."""
    rig.cable.lost_once = lost
    uploading = asyncio.create_task(rig.robot.upload_positions(ROW))
    await rig.cable.written_from(lost)
    if rig.robot.mode == 3:
        rig.cable._deliver(b"POS\r")
    with pytest.raises(RobotPositionsDiffer) as differ:
        await uploading
    return differ.value


@BOTH_MODES
def test_an_upload_that_has_lost_a_line_is_not_called_stored(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await rig.move(HomeRobot())
            error = await upload_without(rig, "POS 120,")
            assert rig.fics.units[1].positions[2] == (130.0, 150.0)  # its neighbour's place
            assert error.detail == (
                "Of 5 positions that were sent to r1/units/1, 4 differ: 2 holds 130,150 and was sent as "
                "120,150; 3 holds 140,150 and was sent as 130,150; 4 holds 150,150 and was sent as 140,150; "
                "so do 1 more. A line was lost, doubled or garbled on its way; others may be overwritten."
            )
            assert (error.moved, error.retryable) == ("no", True)
            await rig.robot.upload_positions(ROW)
            move = await rig.move(MoveToPosition(position=2))
            assert (move.status, move.position) == (MoveStatus.SUCCEEDED, {"X": 120.0, "Y": 150.0, "Z": 0.0})

    story()


@BOTH_MODES
def test_the_last_line_of_an_upload_may_be_the_one_that_is_lost(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            error = await upload_without(rig, "POS 150,")
            assert "1 differ: 5 is not set and was sent as 150,150." in error.detail

    story()


@in_virtual_time
async def test_a_position_that_keeps_an_axis_it_should_not_have_differs() -> None:
    async with fics_rig(mode=2) as rig:
        rig.fics.units[1].positions[2] = (7.0, 8.0)
        rig.cable.lost_once = "POS 7"
        with pytest.raises(RobotPositionsDiffer, match="1 holds 7,8 and was sent as 7"):
            await rig.robot.upload_positions([(1, [7.0]), (2, [7.0, 8.0])])


@pytest.mark.parametrize(
    ("sent", "held", "same"),
    [
        ([1.0, None, 2.5], [1.0, None, 2.5], True),
        ([1.005], [1.0], True),
        ([1.005], [1.01], True),
        ([1.0], [1.01], False),
        ([1.0], [1.0, 0.0], False),
        ([1.0, None, 2.0], [1.0, 0.0, 2.0], False),
        ([12_345_678], [12_345_679], False),
    ],
)
def test_stored_positions_agree_as_far_as_they_are_displayed(
    sent: list[float | None], held: list[float | None], same: bool
) -> None:
    assert agrees(UploadPosition(coordinates=sent), StoredPosition(coordinates=held)) is same
    assert not agrees(UploadPosition(coordinates=sent), None)


@in_virtual_time
async def test_an_upload_that_cannot_be_read_back_is_not_called_stored() -> None:
    async with fics_rig(mode=2) as rig:
        rig.cable.lost_answer = "POS"
        with pytest.raises(NotReadBack, match="5 positions were sent to r1/units/1, but could not be read"):
            await rig.robot.upload_positions(ROW)


@BOTH_MODES
def test_a_stop_waits_for_no_reading_back(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode, baud=9600) as rig:
            many = [(number, [float(number), 0.0]) for number in range(1, 60)]
            uploading = asyncio.create_task(rig.robot.upload_positions(many))
            await rig.cable.written_from("POR")
            before = len(rig.cable.written)
            asked_at = asyncio.get_running_loop().time()
            report = await rig.robot.stop("immediate")
            assert "AES" in rig.cable.frames(before)[:1]
            assert report.state == "confirmed"
            assert asyncio.get_running_loop().time() - asked_at < 1.0
            with pytest.raises(NotReadBack, match="A stop of r1 came first"):
                await uploading

    story()


@in_virtual_time
async def test_until_a_table_is_read_back_nothing_moves() -> None:
    async with fics_rig(baud=9600) as rig:
        await rig.move(HomeRobot())
        uploading = asyncio.create_task(rig.robot.upload_positions(ROW))
        await rig.cable.written_from("POR")
        with pytest.raises(RobotBusy, match=r"being changed and read back; POM was not sent"):
            await rig.move(MoveToPosition(position=1))
        await uploading
        assert (await rig.move(MoveToPosition(position=1))).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_two_uploads_at_once_are_each_read_back_before_the_next() -> None:
    async with fics_rig(mode=2, baud=9600) as rig:
        other = [(number, [5.0, 5.0]) for number, _ in ROW]
        await asyncio.gather(rig.robot.upload_positions(ROW), rig.robot.upload_positions(other))
        assert set(rig.fics.units[1].positions.values()) == {(5.0, 5.0)}


@BOTH_MODES
def test_positions_whose_reading_alone_is_garbled_do_not_differ(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            rig.cable.misread = {"POS 7,8": "POS 7,9"}
            await rig.robot.upload_positions([(1, [5.0, 6.0]), (2, [7.0, 8.0])])
            assert rig.cable.misread == {}
            assert rig.fics.units[1].positions[2] == (7.0, 8.0)

    story()


# clearing


@in_virtual_time
async def test_in_mode_2_a_lost_clear_is_not_called_done() -> None:
    async with fics_rig(mode=2) as rig:
        await rig.robot.upload_positions(ROW)
        rig.cable.lost_once = "PCL"
        with pytest.raises(NotDone, match="PCL 2,3 was sent to r1/units/1, and position 2 is still set"):
            await rig.robot.ask(ClearPositions(first=2, count=3), 1)
        assert len(rig.fics.units[1].positions) == 5
        await rig.robot.ask(ClearPositions(first=2, count=3), 1)
        assert set(rig.fics.units[1].positions) == {1, 5}


@in_virtual_time
async def test_in_mode_2_a_clear_that_nothing_proves_is_not_called_done() -> None:
    async with fics_rig(mode=2) as rig:
        rig.fics.units[1].positions[12] = (1.0,)
        rig.cable.lost_once = "PCL"
        with pytest.raises(NoReply, match="nothing tells whether it was done"):
            await rig.robot.ask(ClearPositions(first=10), 1)
        rig.cable.lost_once = "PCL"
        with pytest.raises(NotDone, match="position 12 is still set"):
            await rig.robot.ask(ClearPositions(first=10, count=3), 1)
        await rig.robot.ask(ClearPositions(first=10, count=1), 1)  # one that is not set is cleared


@in_virtual_time
async def test_in_mode_2_a_clear_that_cannot_be_looked_at_was_sent_and_nobody_says_more() -> None:
    async with fics_rig(mode=2) as rig:
        await rig.robot.upload_positions(ROW)
        clearing = asyncio.create_task(rig.robot.ask(ClearPositions(), 1))
        await rig.cable.written_from("PCL")
        rig.cable.lost_answer = "PO"
        with pytest.raises(NotReadBack, match="PCL was sent to r1/units/1, but could not be read back"):
            await clearing


@in_virtual_time
async def test_in_mode_3_the_answer_tells_that_positions_are_cleared() -> None:
    async with fics_rig() as rig:
        await rig.robot.upload_positions(ROW)
        asked = len(rig.heard("POR"))
        await rig.robot.ask(ClearPositions(), 1)
        assert rig.fics.units[1].positions == {}
        assert len(rig.heard("POR")) == asked
