"""The log of a plant: what happened, and who did it, one line each."""

import asyncio
import logging
from typing import Any, Final

import pytest

from gateway import logbook
from gateway.core.origin import Origin
from gateway.door.doing import do
from gateway.door.stopping import stop
from gateway.event_types import EVENT_TYPES
from protocols.rorze.moves import MoveClockwise
from simulator.rorze.world import EMS
from tests.fics_plants import fics_rig
from tests.plants import ended, finished, in_virtual_time, rig

PAT: Final = Origin("pat", "r-1")


def lines(caplog: pytest.LogCaptureFixture, level: int = logging.INFO) -> list[tuple[str, dict[str, Any]]]:
    return [
        (record.getMessage(), getattr(record, "facts", {}))
        for record in caplog.records
        if record.name == "gateway.logbook" and record.levelno >= level
    ]


def test_each_end_of_a_move_and_a_stop_has_a_line(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)

    @in_virtual_time
    async def story() -> None:
        async with rig() as it:
            await do(it.plant, PAT, "/bodies/3F", MoveClockwise(distance=500), 60.0)
            [move] = it.plant.moves.log.of(it.body().address)
            await do(it.plant, PAT, "/bodies/3F", MoveClockwise(distance=50_000))
            [far, _] = it.plant.moves.log.of(it.body().address)
            await stop(it.plant, PAT, "/bodies/3F", "immediate")
            await ended(it, far)
            (first, facts), *others = lines(caplog)
            assert first == f"move {move.id} of line1.3F (relative) succeeded at 500 (normal)"
            assert (facts["caller"], facts["request_id"], facts["move_id"]) == ("pat", "r-1", move.id)
            assert "stop of line1.3F confirmed" in [line for line, _ in others]
            assert any(line.startswith(f"move {far.id} of line1.3F (relative) stopped") for line, _ in others)
            assert lines(caplog, logging.WARNING) == [], "all that was wanted"

    story()


def test_what_goes_wrong_is_a_warning(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)

    @in_virtual_time
    async def story() -> None:
        async with rig() as it:
            moving = asyncio.create_task(finished(it, MoveClockwise(distance=50_000)))
            await asyncio.sleep(0.3)
            it.touch(0x3F, lambda axis: axis.world.forced.update({EMS: True}))
            move = await moving
            warnings = [line for line, _ in lines(caplog, logging.WARNING)]
            failed = f"move {move.id} of line1.3F (relative) failed"
            assert any(line.startswith(failed) for line in warnings)
            assert any(" body.move.failed: " in line for line in warnings)

    story()


def test_an_orderly_end_warns_of_nothing(caplog: pytest.LogCaptureFixture) -> None:
    @in_virtual_time
    async def story() -> None:
        async with rig(), fics_rig():
            pass

    story()
    assert [it.getMessage() for it in caplog.records if it.levelno >= logging.WARNING] == []


def test_lines_are_of_events_that_there_are() -> None:
    assert logbook._LINES.keys() <= EVENT_TYPES.keys()
