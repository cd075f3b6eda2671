"""Software stops, without HTTP."""

import pytest

from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.origin import Origin
from gateway.door import stopping
from gateway.door.doing import do
from protocols.rorze.moves import MoveClockwise
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time, rig

ME = Origin("test")


@in_virtual_time
async def test_a_group_is_stopped_with_one_frame_for_all_and_then_one_for_each() -> None:
    async with rig() as it:
        await do(it.plant, ME, "/groups/80", MoveClockwise(distance=90_000))
        sent = len(it.wire.sent)
        stopped = await stopping.stop(it.plant, ME, "/groups/80", "immediate")
        assert stopped.confirmed
        assert [frame for frame in it.wire.frames(sent) if "5IS" in frame][:3] == [
            "&805IS",
            "&005IS",
            "&015IS",
        ]


@in_virtual_time
async def test_everything_is_stopped_at_once() -> None:
    async with rig(lines=("left", "right")) as it:
        stopped = await stopping.stop_all(it.plant, ME, "decelerate")
        assert stopped.confirmed
        assert {name: len(those) for name, those in stopped.reports.items()} == {"bodies": 6, "robots": 0}


@in_virtual_time
async def test_the_stop_of_a_unit_is_that_of_its_robot() -> None:
    async with fics_rig() as it:
        stopped = await stopping.stop(it.plant, ME, "/robots/r1/units/1", "immediate")
        assert [report.state for report in stopped.reports["robots"]] == ["confirmed"]
        with pytest.raises(NotFound):
            await stopping.stop(it.plant, ME, "/robots/r1/units/9", "immediate")


@in_virtual_time
async def test_a_line_has_no_motor() -> None:
    async with rig() as it:
        with pytest.raises(InvalidRequest, match="no motor"):
            await stopping.stop(it.plant, ME, "/lines/line1", "immediate")
