"""Positions of a unit: stored undivided, in runs, and read again."""

import asyncio

import pytest

from gateway.core.errors import ControllerRefused, InvalidRequest, NoReply
from gateway.fics.errors import UploadBrokenOff
from protocols.fics.notation import AxisSystem
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time

BOTH_MODES = pytest.mark.parametrize("mode", [2, 3])


@BOTH_MODES
def test_positions_are_stored_in_runs_and_read_again(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            sent = len(rig.cable.written)
            await rig.robot.upload_positions([(1, [1.0, 2.0, 3.0]), (7, [7.0, None, 7.5]), (2, [4.0])])
            spoken = [text for text in rig.cable.frames(sent) if text[:3] in ("POF", "POS")]
            assert spoken == ["POF 1,1", "POS 1,2,3", "POS 4", "POF 2", "POF 1,7", "POS 7,,7.5", "POF 2"]
            assert await rig.robot.positions(1, 5) == [(1, [1.0, 2.0, 3.0]), (2, [4.0])]
            assert await rig.robot.positions(7, 7) == [(7, [7.0, None, 7.5])]

    story()


@in_virtual_time
async def test_an_impossible_position_keeps_all_from_being_sent() -> None:
    async with fics_rig() as rig:
        sent = len(rig.cable.written)
        for positions in ([(0, [1.0])], [(1, [1.0]), (1, [2.0])], [(1, [None])], [(1, [1e12])]):
            with pytest.raises(InvalidRequest, match="nothing was sent"):
                await rig.robot.upload_positions(positions)
        assert rig.cable.frames(sent) == []


@BOTH_MODES
def test_an_upload_that_is_refused_is_ended_nevertheless(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            unit = rig.robot.unit(1)
            unit.axes, unit.systems = [*unit.axes, "W"], {**unit.systems, "W": AxisSystem.PULSE}
            with pytest.raises(ControllerRefused) as refused:
                await rig.robot.upload_positions([(1, [1.0, 2.0, 3.0, 4.0])])
            assert refused.value.error_code == "E11"
            assert rig.fics.upload is None
            assert not rig.robot.line.uploading

    story()


@in_virtual_time
async def test_positions_that_do_not_fit_the_axes_are_refused_before_anything_is_sent() -> None:
    async with fics_rig() as rig:
        unit = rig.robot.unit(1)
        unit.systems = {**unit.systems, "Z": AxisSystem.PULSE}
        sent = len(rig.cable.written)
        with pytest.raises(InvalidRequest, match="has the axes X, Y, Z, and 4 coordinates were given"):
            await rig.robot.upload_positions([(1, [1.0]), (2, [1.0, 2.0, 3.0, 4.0])])
        with pytest.raises(InvalidRequest, match="Axis Z: pulses are whole"):
            await rig.robot.upload_positions([(1, [1.5, 2.5, 3.5])])
        assert rig.cable.frames(sent) == []


@in_virtual_time
async def test_an_upload_that_cannot_begin_leaves_none_open() -> None:
    async with fics_rig() as rig:
        await rig.robot.unit(1).position()
        rig.edit(True)
        with pytest.raises(ControllerRefused):
            await rig.robot.upload_positions([(1, [1.0])])
        assert await rig.robot.unit(1).status()  # which no upload would let through
        assert not rig.robot.line.uploading
        assert rig.heard("POS") == []


@in_virtual_time
async def test_an_upload_that_loses_its_line_tells_what_may_be_stored() -> None:
    async with fics_rig() as rig:
        uploading = asyncio.create_task(
            rig.robot.upload_positions([(number, [float(number)]) for number in range(1, 9)])
        )
        await rig.cable.written_from("POS 3")
        rig.cable.unplug()
        with pytest.raises(
            UploadBrokenOff,
            match=r"up to 2 were sent to r1.* The next one may be stored as well.* not read back",
        ):
            await uploading
        rig.cable.plugged_in = True
        await asyncio.sleep(10)
        assert rig.fics.upload is None
        assert not rig.robot.line.uploading


@in_virtual_time
async def test_an_upload_whose_first_position_meets_silence_is_not_said_to_be_unsent() -> None:
    async with fics_rig() as rig:
        await rig.robot.unit(1).position()
        uploading = asyncio.create_task(rig.robot.upload_positions([(1, [1.0])]))
        await rig.cable.written_from("POS 1")
        rig.machine.power_off(asyncio.get_running_loop().time())
        with pytest.raises(NoReply):
            await uploading
