"""A move is followed through crowds, cuts and the silence of others: lost is only what is silent itself."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress

import pytest

from gateway.core.errors import Expired, PortNotOpen
from gateway.core.exchange import Lane
from gateway.core.move_record import LOST_AFTER_S, MoveStatus
from gateway.core.move_runs import OUT_OF_REACH_S
from gateway.rorze.bodies import Body
from gateway.rorze.knowledge import MotorState
from protocols.rorze.moves import MoveClockwise, MoveClockwiseSlowly
from protocols.rorze.notation import PositionReference
from protocols.rorze.position_table import GetPositionEntry
from simulator.faults import Direction, Fault, Switch
from tests.plants import Rig, ended, in_virtual_time, rig, start

LONG = MoveClockwise(distance=50_000)
SHORT = MoveClockwise(distance=5_000)


def now() -> float:
    return asyncio.get_running_loop().time()


def forget_set_up(rig: Rig) -> None:
    """Restart the link master: it announces no end from now on."""
    rig.machine.power_off(now())
    rig.machine.power_on(now())


async def read_on(body: Body, entry: int, answers: list[float]) -> None:
    """Read without a pause, as a client does, and again where the line was not free in time."""
    while True:
        with suppress(Expired):
            await body.ask(GetPositionEntry(entry=PositionReference(position=entry)))
            answers.append(now())


@asynccontextmanager
async def crowd(rig: Rig, readers: int) -> AsyncIterator[list[float]]:
    """Clients that read from every body without a pause; gives when they were answered."""
    answers: list[float] = []
    clients = [
        asyncio.create_task(read_on(body, entry, answers))
        for body in rig.plant.bodies()
        for entry in range(readers)
    ]
    await asyncio.sleep(1.0)
    yield answers
    for client in clients:
        client.cancel()
    await asyncio.gather(*clients, return_exceptions=True)


@pytest.mark.parametrize("announced", [True, False])
@in_virtual_time
async def test_the_end_of_a_move_is_known_soon_on_a_crowded_line(announced: bool) -> None:
    async with rig(bodies=range(8), groups={}, baud=9600) as it:
        if not announced:
            forget_set_up(it)
        async with crowd(it, readers=50):
            move = await start(it, SHORT, "03")
            await ended(it, move)
            stopped_at = it.truth.of("pulses_stop", 3)[-1].at
            assert now() - stopped_at < (0.5 if announced else 4.0)
            assert (move.status, move.position) == (MoveStatus.SUCCEEDED, 5_000)


@in_virtual_time
async def test_thirty_followed_moves_leave_clients_most_of_a_crowded_line() -> None:
    async with rig(bodies=range(30), groups={}, baud=9600) as it:
        forget_set_up(it)
        moves = [await start(it, MoveClockwiseSlowly(distance=1_500), f"{n:02X}") for n in range(30)]
        async with crowd(it, readers=3) as answers:
            answers.clear()
            await asyncio.sleep(20.0)
            assert len(answers) > 20 * 5, "alone they get 11 a second, a fence before each"
        for move in moves:
            assert (await ended(it, move)).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_a_cable_that_is_out_for_longer_than_a_silence_costs_nothing() -> None:
    async with rig() as it:
        move = await start(it, LONG)
        await asyncio.sleep(0.5)
        it.wire.unplug()
        await asyncio.sleep(2 * LOST_AFTER_S)
        it.wire.plugged_in = True
        await ended(it, move)
        assert (move.status, move.position) == (MoveStatus.SUCCEEDED, 50_000)


@in_virtual_time
async def test_a_line_that_stays_down_leaves_the_end_of_the_move_unknown() -> None:
    async with rig() as it:
        move = await start(it, LONG)
        await asyncio.sleep(0.5)
        it.wire.unplug()
        began_at = now()
        await asyncio.sleep(OUT_OF_REACH_S - 10.0)
        assert not move.status.final
        await ended(it, move)
        assert OUT_OF_REACH_S <= now() - began_at < OUT_OF_REACH_S + 10.0
        assert (move.status, it.body().move) == (MoveStatus.UNKNOWN, None)
        assert move.error is not None
        assert "could not be asked for 300 s" in move.error.detail
        assert move.error.moved == "unknown"


@in_virtual_time
async def test_a_link_master_without_power_is_no_silence_of_its_bodies() -> None:
    async with rig() as it:
        move = await start(it, LONG)
        await asyncio.sleep(0.5)
        it.machine.power_off(now())
        await asyncio.sleep(2 * LOST_AFTER_S)
        it.machine.power_on(now())
        await ended(it, move)
        assert (move.status, move.position) == (MoveStatus.SUCCEEDED, 50_000)


@in_virtual_time
async def test_a_port_that_flaps_on_a_garbling_line_does_not_lose_a_move_that_stands_at_its_target() -> None:
    async with rig(baud=9600) as it:
        move = await start(it, SHORT)
        it.machine.faults.set(Switch(Fault.GARBLED, Direction.REPLIES, 0.3))
        for _ in range(80):
            await asyncio.sleep(0.12)  # less than a reading takes after the set-up
            it.wire.unplug()
            await asyncio.sleep(0.3)
            it.wire.plugged_in = True
            await asyncio.sleep(0.3)
        it.machine.faults.clear()
        await ended(it, move)
        assert (move.status, move.position) == (MoveStatus.SUCCEEDED, 5_000)


@in_virtual_time
async def test_a_confirmed_stop_is_evidence_where_nothing_more_is_heard() -> None:
    async with rig() as it:
        move = await start(it, LONG)
        await asyncio.sleep(0.5)
        it.wire.unplug()
        it.body().was_stopped(12_345)
        await asyncio.sleep(OUT_OF_REACH_S)
        await ended(it, move)
        assert (move.status, move.end_cause, move.position) == (MoveStatus.STOPPED, "stop_command", 12_345)
        assert "stop was confirmed" in move.evidence[-1]


@in_virtual_time
async def test_an_announced_end_is_evidence_where_nothing_more_is_heard() -> None:
    async with rig() as it:
        move = await start(it, LONG)
        await asyncio.sleep(0.5)
        it.machine.switch_body(0x3F, on=False, now=now())
        it.body().motion.end_was_announced()
        await ended(it, move)
        assert move.status is MoveStatus.UNKNOWN
        assert "announced the end" in move.evidence[-1]


@in_virtual_time
async def test_a_reading_before_a_cut_and_one_after_it_make_a_pair(monkeypatch: pytest.MonkeyPatch) -> None:
    async with rig() as it:
        move = await start(it, SHORT)
        await asyncio.sleep(0.1)
        body, looks = it.body(), 0
        look = body.poll
        it.plant.line("line1")._session.last_error_at = now() + LOST_AFTER_S

        async def every_second_look(lane: Lane = Lane.READ) -> MotorState:
            nonlocal looks
            looks += 1
            if looks % 2:
                return await look(lane)
            raise PortNotOpen("the line is down")

        monkeypatch.setattr(body, "poll", every_second_look)
        await ended(it, move)
        assert (move.status, move.position) == (MoveStatus.SUCCEEDED, 5_000)
        assert now() < LOST_AFTER_S
