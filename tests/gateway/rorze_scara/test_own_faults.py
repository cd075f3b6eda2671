"""A fault of the gateway itself amid a SCARA's move: the move ends, no axis goes on, and it moves again."""

import asyncio
from contextlib import suppress

import pytest

from gateway.core.errors import GatewayError
from gateway.core.move_record import MoveStatus
from gateway.rorze.move_proof import BodyRun
from gateway.rorze.power import Mark
from gateway.rorze_scara import geometry, moves, preparation
from gateway.rorze_scara.moves import ScaraMotion, ScaraRun
from tests.gateway.rorze_scara.cell import START, Cell, cell, mm
from tests.own_faults import Place, fail_once, named
from tests.plants import in_virtual_time

AGAIN_S = 30.0
"""Seconds after which the gateway is itself again, whatever has happened."""
SLOW = 5
"""The number of a pattern."""


async def moves_again(robot: Cell) -> bool:
    await robot.put(*START)
    return (await robot.finished("line", x=mm(10), y=mm(120))).status is MoveStatus.SUCCEEDED


@pytest.mark.parametrize(
    "place",
    [
        (geometry, "_agrees"),
        (preparation, "_require_power"),
        (moves, "_note_plan"),
        (ScaraMotion, "_prepare"),
        (ScaraMotion, "_write"),
        (ScaraRun, "_look_after"),
        (ScaraRun, "_note_axes"),
        (ScaraRun, "_finding"),
        (ScaraRun, "end"),
        (Mark, "stands"),
        (BodyRun, "_take_start"),
    ],
    ids=named,
)
@in_virtual_time
async def test_a_move_that_a_fault_has_met_is_over_in_the_end(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with cell() as robot:
        failed = fail_once(monkeypatch, place)
        with suppress(GatewayError, ZeroDivisionError):
            await robot.start("line", x=mm(20), y=mm(130))
        await asyncio.sleep(AGAIN_S)
        assert failed
        assert robot.scara.move is None
        [move] = robot.moves.log.of("wafer")
        assert move.status.final
        assert move.ended_at is not None
        assert not any(robot.moving())
        assert await moves_again(robot)


@in_virtual_time
async def test_no_axis_moves_on_where_nobody_sees_to_their_common_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with cell() as robot:
        fail_once(monkeypatch, (ScaraRun, "follow"))
        await robot.start("line", x=mm(40), y=mm(150), pattern=SLOW)
        await asyncio.sleep(1.0)
        assert not any(robot.moving())
        [move] = robot.moves.log.of("wafer")
        assert move.status is MoveStatus.UNKNOWN
        assert "A fault of the gateway itself (ZeroDivisionError)" in move.evidence[-1]
        assert await moves_again(robot)


@pytest.mark.parametrize("place", [(ScaraRun, "_look"), (ScaraRun, "_stop_all")], ids=named)
@in_virtual_time
async def test_all_axes_are_stopped_where_one_falls_silent_in_spite_of_a_fault(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with cell() as robot:
        await robot.start("line", x=mm(40), y=mm(150), pattern=SLOW)
        await asyncio.sleep(0.3)
        failed = fail_once(monkeypatch, place)
        robot.switch(0x03, on=False)
        await asyncio.sleep(2.0)
        assert failed
        assert not any(robot.moving())
