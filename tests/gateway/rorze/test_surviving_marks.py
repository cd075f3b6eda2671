"""Boards that keep their user comments without power: a mark that stands outvotes no change."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from gateway.core.errors import PowerCycled
from gateway.core.move_record import MoveStatus
from protocols.rorze.modes import GetSoftLimits
from protocols.rorze.moves import MoveClockwise, MoveTo
from protocols.rorze.origin import Home
from protocols.rorze.programs import RunProgram
from simulator.faults import Direction
from simulator.rorze.world import EMS
from tests.plants import Rig, ended, finished, in_virtual_time, lose, rig, start

NOTICED_S = 12.0
"""Seconds after which a change at rest has shown in the health poll."""
SHORT_S = 0.15


@asynccontextmanager
async def battery_board(body_options: str = "") -> AsyncIterator[Rig]:
    """A body whose user comments outlast its power."""
    async with rig(bodies=(0x3F,), groups={}, body_options=body_options) as it:
        it.axis().keeps_comments = True
        yield it


def brown_out(it: Rig, for_s: float = SHORT_S) -> None:
    it.machine.brown_out(0x3F, for_s, asyncio.get_running_loop().time())
    it.wire.turn()


def why(it: Rig) -> list[object]:
    """Reasons of the likely losses of power, as told."""
    return [event.data["why"] for event in it.events("body.power_cycled") if not event.data["certain"]]


@in_virtual_time
async def test_a_position_that_fell_to_0_makes_the_place_unknown_though_the_mark_stands() -> None:
    async with battery_board() as it:
        await finished(it, MoveTo(position=1750))
        brown_out(it)
        await asyncio.sleep(3.0)
        with pytest.raises(PowerCycled, match="1AM was not sent"):
            await start(it, MoveTo(position=1500))
        assert why(it) == ["its position went from 1750 to 0"]
        assert it.axis().motor.pulses(asyncio.get_running_loop().time()) == 1750


@in_virtual_time
async def test_a_place_that_is_acknowledged_is_used_again() -> None:
    async with battery_board() as it:
        await finished(it, MoveTo(position=1750))
        brown_out(it)
        await asyncio.sleep(NOTICED_S)
        await it.body().acknowledge_power_cycle()
        await asyncio.sleep(NOTICED_S)
        assert (await finished(it, MoveTo(position=100))).status is MoveStatus.SUCCEEDED
        assert len(why(it)) == 1


@in_virtual_time
async def test_an_error_that_went_by_itself_makes_the_place_unknown() -> None:
    async with battery_board() as it:
        it.touch(0x3F, lambda axis: axis.world.forced.update({EMS: True}))
        it.axis().status |= 0x04
        await asyncio.sleep(NOTICED_S)
        it.touch(0x3F, lambda axis: axis.world.forced.pop(EMS))
        brown_out(it)
        await asyncio.sleep(NOTICED_S)
        assert why(it) == ["ems_error went from its status"]


@in_virtual_time
async def test_a_setting_that_is_another_makes_the_place_unknown() -> None:
    async with battery_board() as it:
        it.axis().execute("EPS-5000,5000", asyncio.get_running_loop().time())
        await it.body().ask(GetSoftLimits())
        brown_out(it)
        await asyncio.sleep(SHORT_S + 0.05)
        await it.body().ask(GetSoftLimits())
        await asyncio.sleep(1.0)
        assert why(it) == ["EPD is not answered as before"]


@pytest.mark.parametrize("keeps_position", [False, True])
@in_virtual_time
async def test_a_loss_in_the_middle_of_a_move_makes_the_place_unknown(keeps_position: bool) -> None:
    async with battery_board() as it:
        await finished(it, MoveTo(position=1000))
        it.axis().keeps_position = keeps_position
        move = await start(it, MoveTo(position=60_000))
        await asyncio.sleep(0.5)
        brown_out(it)
        await ended(it, move)
        assert move.status is (MoveStatus.FAILED if keeps_position else MoveStatus.LOST)
        assert move.position != 60_000
        assert it.body().power.cycled
        with pytest.raises(PowerCycled):
            await start(it, MoveTo(position=1500))


@in_virtual_time
async def test_a_motor_that_runs_where_its_move_does_not_lead_has_not_arrived() -> None:
    async with battery_board() as it:
        await finished(it, MoveTo(position=50_000))
        starting = asyncio.create_task(start(it, MoveTo(position=60_000)))
        await it.wire.begun("&3F1AM60000")
        brown_out(it, 0.0)
        move = await ended(it, await starting)
        assert (move.status, move.position) == (MoveStatus.LOST, 60_000)
        assert "elsewhere than between 50000 and 60000" in " ".join(move.evidence)


@pytest.mark.parametrize("command", [Home(), MoveClockwise(distance="endless")])
@in_virtual_time
async def test_a_move_without_a_target_that_ends_silently_is_no_success(
    command: Home | MoveClockwise,
) -> None:
    async with battery_board() as it:
        await finished(it, MoveTo(position=50_000))
        move = await start(it, command)
        await asyncio.sleep(0.1)
        brown_out(it)
        await ended(it, move)
        assert move.status in (MoveStatus.UNKNOWN, MoveStatus.LOST)
        assert (it.body().power.homed, it.body().power.cycled) == ("no", True)


@in_virtual_time
async def test_a_program_that_moves_the_motor_explains_where_it_is() -> None:
    async with battery_board() as it:
        it.axis().program = ("1+M500", "WAT100", "1+M300", "WAT100", "END")
        run = await it.plant.rorze.runs.start(it.body(), RunProgram())
        await it.plant.rorze.runs.wait(run, 60.0)
        await asyncio.sleep(NOTICED_S)
        assert (run.status, run.end_cause, it.body().told.position) == ("ended", "normal", 800)
        assert not it.body().power.cycled


@in_virtual_time
async def test_one_garbled_reading_changes_nothing() -> None:
    async with battery_board() as it:
        await finished(it, MoveTo(position=1750))
        execute = it.axis().execute
        garbled: list[str] = []

        def once(text: str, now: float) -> object:
            response = execute(text, now)
            if text == "6PD" and not garbled:
                garbled.append(text)
                return type(response)("+000000000")
            return response

        it.axis().execute = once  # type: ignore[method-assign, assignment]
        await asyncio.sleep(NOTICED_S)
        await it.body().poll()
        await asyncio.sleep(NOTICED_S)
        assert garbled
        assert not it.body().power.cycled
        assert (await finished(it, MoveTo(position=1500))).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_where_nothing_tells_each_silence_can_ask_for_an_acknowledgement() -> None:
    async with battery_board("silence_needs_acknowledgement = true") as it:
        it.axis().keeps_position = True
        await finished(it, MoveTo(position=1750))
        brown_out(it, 8.0)
        await asyncio.sleep(20.0)
        with pytest.raises(PowerCycled):
            await start(it, MoveTo(position=1500))
        assert why(it) == ["it was out of reach"]
        await it.body().acknowledge_power_cycle()
        assert (await finished(it, MoveTo(position=1500))).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_a_silence_needs_no_acknowledgement_where_the_mark_tells() -> None:
    async with rig(bodies=(0x3F,), groups={}) as it:
        await finished(it, MoveTo(position=1750))
        it.wire.unplug()
        await asyncio.sleep(5.0)
        it.wire.plugged_in = True
        await asyncio.sleep(NOTICED_S)
        assert not it.body().power.cycled


# a stop that was confirmed


@in_virtual_time
async def test_a_move_whose_acknowledgement_was_lost_and_that_was_stopped_is_stopped() -> None:
    async with rig(bodies=(0x3F,), groups={}) as it:
        starting = asyncio.create_task(start(it, MoveClockwise(distance=500_000)))
        await it.wire.begun("&3F1+M500000")
        lose(it, Direction.REPLIES)
        await asyncio.sleep(0.2)
        stop = it.plant.stops.stop([it.body()], "immediate")
        move = await ended(it, await starting)
        await stop
        assert (move.status, move.end_cause) == (MoveStatus.STOPPED, "stop_command")
        assert move.position == it.body().motion.stopped_at
        assert not it.body().power.cycled
