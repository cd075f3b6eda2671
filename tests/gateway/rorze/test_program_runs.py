"""Runs of programs: why they ended is told in words, and never guessed."""

import asyncio
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from gateway.core.errors import BodyBusy, Cancelled, NoReply
from gateway.rorze.program_runs import END_CAUSES, ProgramRun, cause_of
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.programs import RunProgram
from protocols.rorze.speeds import SetMaximumAcceleration, SetMaximumSpeed, SetStartSpeed
from simulator.faults import Direction, Fault, Switch
from tests.plants import Rig, in_virtual_time, lose, rig, start

WAITING = ("*W", "WAT50", "JMP*W")


@asynccontextmanager
async def waiting_body() -> AsyncIterator[Rig]:
    """A body with a program that never ends."""
    async with rig(bodies=(0x3F,), groups={}) as it:
        it.axis().program = WAITING
        yield it


def starting_on(it: Rig) -> "asyncio.Task[ProgramRun]":
    return asyncio.create_task(it.plant.rorze.runs.start(it.body(), RunProgram()))


@pytest.mark.parametrize(
    ("status", "cause"),
    [
        (0x00, "normal"),
        (0x01, None),
        (0x02, "stopped"),
        (0x04, "command_error"),
        (0x08, "nothing_there"),
        (0x10, "error_end"),
        (0x20, "move_while_moving"),
        (0x80, "single_step"),
        (0x84, "command_error+single_step"),
        (0x81, None),
    ],
)
def test_the_bits_of_urd_are_told_in_words(status: int, cause: str | None) -> None:
    assert cause_of(status) == cause
    assert sum(END_CAUSES) == 0xBE


@in_virtual_time
async def test_a_run_whose_acknowledgement_is_lost_is_found_running() -> None:
    async with waiting_body() as it:
        starting = starting_on(it)
        await it.wire.begun("&3FURG")
        lose(it, Direction.REPLIES)
        assert (await starting).status == "running"
        assert it.wire.frames().count("&3FURG") == 1


@in_virtual_time
async def test_a_run_whose_command_was_doubled_is_found_running() -> None:
    async with waiting_body() as it:
        starting = starting_on(it)
        await it.wire.begun("&3FURG")
        it.machine.faults.set(Switch(Fault.DOUBLED, Direction.REQUESTS, next_frames=1))
        lose(it, Direction.REPLIES)
        assert (await starting).status == "running"
        assert [fact.facts["reply"] for fact in it.truth.of("command") if fact.facts["text"] == "URG"] == [
            "",
            "@5A",
        ]


@in_virtual_time
async def test_no_program_is_started_while_one_runs_that_the_gateway_has_not_started() -> None:
    async with waiting_body() as it:
        it.axis().execute("URG", asyncio.get_running_loop().time())
        with pytest.raises(BodyBusy, match="runs a program already; URG was not sent"):
            await it.plant.rorze.runs.start(it.body(), RunProgram())
        assert "&3FURG" not in it.wire.frames()


@in_virtual_time
async def test_another_program_is_not_timed_as_the_last_run() -> None:
    async with rig(bodies=(0x3F,), groups={}) as it:
        it.axis().program = WAITING
        runs = it.plant.rorze.runs
        run = await runs.start(it.body(), RunProgram())
        await it.plant.stops.stop([it.body()], "immediate")
        assert (await runs.state(it.body())).elapsed_s is not None
        it.axis().execute("URG", asyncio.get_running_loop().time())
        state = await runs.state(it.body())
        assert (state.running, state.elapsed_s) == (True, None)
        assert (run.status, run.end_cause) == ("ended", "stopped")


@in_virtual_time
async def test_a_move_beside_a_program_that_moves_the_motor_names_the_program() -> None:
    async with rig(bodies=(0x3F,), groups={}) as it:
        it.axis().program = ("1+MZ", *WAITING)
        await it.plant.rorze.runs.start(it.body(), RunProgram())
        with pytest.raises(BodyBusy, match=r"moves already, by its user program; 1\+M was not sent"):
            await start(it, MoveClockwise(distance=5))


@in_virtual_time
async def test_what_a_program_moves_that_the_gateway_has_started_is_no_foreign_motion() -> None:
    async with rig(bodies=(0x3F,), groups={}) as it:
        it.axis().program = ("1+MZ", *WAITING)
        runs = it.plant.rorze.runs
        await runs.start(it.body(), RunProgram())
        await asyncio.sleep(6.0)
        assert it.body().moving
        await it.plant.stops.stop([it.body()], "immediate")
        await asyncio.sleep(1.0)
        assert not it.body().moving
        assert not it.types("body.motion")
        it.axis().execute("1+MZ", asyncio.get_running_loop().time())
        await asyncio.sleep(6.0)
        assert it.types("body.motion") == ["body.motion.foreign"]


@in_virtual_time
async def test_a_run_does_not_begin_after_a_stop_that_came_first() -> None:
    async with waiting_body() as it:
        starting = starting_on(it)
        await it.wire.begun("&3FURD")
        stopping = it.plant.stops.stop([it.body()], "immediate")
        with pytest.raises(Cancelled):
            await starting
        await stopping
        assert "&3FURG" not in it.wire.frames()


@in_virtual_time
async def test_a_run_whose_command_is_lost_is_not_sent_again() -> None:
    async with waiting_body() as it:
        starting = starting_on(it)
        await it.wire.begun("&3FURG")
        lose(it, Direction.REQUESTS)
        with pytest.raises(NoReply):
            await starting
        assert it.wire.frames().count("&3FURG") == 1
        assert not it.types("body.program")


@in_virtual_time
async def test_after_a_loss_of_power_nobody_knows_how_a_run_has_ended() -> None:
    async with waiting_body() as it:
        runs = it.plant.rorze.runs
        run = await runs.start(it.body(), RunProgram())
        it.body().power.lost(certain=True)
        await runs.wait(run, 5.0)
        assert (run.status, run.end_cause) == ("unknown", None)
        assert run.detail is not None
        assert "lost its power" in run.detail


FOR_EVER = ("*L", "INCD0", "WAT1", "JMP*L", "END")


def brown_out(it: Rig, for_s: float) -> None:
    """Take the power of the body away for a moment."""
    it.machine.brown_out(0x3F, for_s, asyncio.get_running_loop().time())
    it.wire.turn()


@pytest.mark.parametrize("for_s", [0.02, 0.2, 0.7, 1.5])
@pytest.mark.parametrize("keeps_comments", [False, True])
@pytest.mark.parametrize("options", ["", "power_comment = 0", "needs_origin = false"])
@in_virtual_time
async def test_a_run_that_a_loss_of_power_has_ended_is_not_told_as_a_normal_end(
    for_s: float, keeps_comments: bool, options: str
) -> None:
    async with rig(bodies=(0x3F,), groups={}, body_options=options) as it:
        it.axis().program = it.axis().flash.program = FOR_EVER
        it.axis().keeps_comments = keeps_comments
        run = await it.plant.rorze.runs.start(it.body(), RunProgram())
        await asyncio.sleep(2.0)
        brown_out(it, for_s)
        await it.plant.rorze.runs.wait(run, 20.0)
        assert (run.status, run.end_cause, run.ended_at_address) == ("unknown", None, None)
        assert "lost its power" in (run.detail or "")
        assert not it.axis().run.running
        state = await it.plant.rorze.runs.state(it.body())
        assert (state.running, state.end_cause) == (False, None)


@in_virtual_time
async def test_a_loss_of_power_that_was_acknowledged_meanwhile_is_still_told_of_the_run() -> None:
    async with waiting_body() as it:
        runs = it.plant.rorze.runs
        run = await runs.start(it.body(), RunProgram())
        it.body().power.lost(certain=True)
        it.body().power.acknowledge("request")
        await runs.wait(run, 5.0)
        assert (run.status, run.detail) == ("unknown", f"{it.body().address} has lost its power.")


@pytest.mark.parametrize(
    ("options", "end"), [("", ("ended", "normal")), ("power_comment = 0", ("unknown", None))]
)
@in_virtual_time
async def test_a_normal_end_that_came_while_the_body_was_silent_needs_the_mark(
    options: str, end: tuple[str, str | None]
) -> None:
    async with rig(bodies=(0x3F,), groups={}, body_options=options) as it:
        it.axis().program = ("WAT50", "END")
        run = await it.plant.rorze.runs.start(it.body(), RunProgram())
        it.wire.deaf_to = re.compile(b">&3F[^\r]*\r")
        await asyncio.sleep(10.0)
        assert not it.body().online
        it.wire.deaf_to = None
        await it.plant.rorze.runs.wait(run, 60.0)
        assert (run.status, run.end_cause) == end
        assert (run.detail is None) == (end[0] == "ended")


@in_virtual_time
async def test_a_program_of_a_single_end_ends_normally() -> None:
    async with rig(bodies=(0x3F,), groups={}) as it:
        it.axis().program = ("END",)
        run = await it.plant.rorze.runs.start(it.body(), RunProgram())
        await it.plant.rorze.runs.wait(run, 5.0)
        assert (run.status, run.end_cause, run.ended_at_address) == ("ended", "normal", 0)


@in_virtual_time
async def test_a_run_is_followed_on_when_the_line_comes_back() -> None:
    async with rig(bodies=(0x3F,), groups={}) as it:
        it.axis().program = ("WAT50", "END")
        runs = it.plant.rorze.runs
        run = await runs.start(it.body(), RunProgram())
        it.wire.unplug()
        await asyncio.sleep(2.0)
        assert (run.status, run.detail is None) == ("running", False)
        it.wire.plugged_in = True
        await runs.wait(run, 60.0)
        assert (run.status, run.end_cause, run.detail) == ("ended", "normal", None)


@in_virtual_time
async def test_no_program_is_started_while_the_gateway_moves_the_motor() -> None:
    async with waiting_body() as it:
        for command in (
            SetStartSpeed(speed=5_000),
            SetMaximumSpeed(speed=50_000),
            SetMaximumAcceleration(acceleration=100_000),
        ):
            await it.body().ask(command)
        await start(it, MoveClockwise(distance=500_000))
        with pytest.raises(BodyBusy, match="no program was started"):
            await it.plant.rorze.runs.start(it.body(), RunProgram())


@in_virtual_time
async def test_a_body_without_a_program_is_not_asked_what_it_would_refuse() -> None:
    async with rig(bodies=(0x3F,), groups={}) as it:
        state = await it.plant.rorze.runs.state(it.body())
        assert (state.running, state.instruction) == (False, None)
        assert not [frame for frame in it.wire.frames() if frame.startswith("&3FUPD")]
        it.axis().program = ("END",)
        state = await it.plant.rorze.runs.state(it.body())
        assert (state.running, state.instruction) == (False, "END")
