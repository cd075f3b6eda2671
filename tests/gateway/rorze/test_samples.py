"""The samples of a move: where the body was seen, and where its plan has it."""

import pytest

from gateway.core.move_record import Move
from gateway.rorze.samples import BodySamples, samples_of
from protocols.rorze.encoder import SetEncoderRatio
from protocols.rorze.modes import SetOperatingMode
from protocols.rorze.moves import MoveClockwise, MoveCounterclockwise, MoveTo
from protocols.rorze.origin import Home
from protocols.rorze.row import RorzeCommand
from protocols.rorze.speeds import SetMaximumAcceleration, SetMaximumSpeed, SetStartSpeed
from protocols.table import Ack
from tests.plants import Rig, ended, finished, in_virtual_time, rig, start
from tests.watching import watching

FAST = "move_samples_per_s = 20"


async def teach(rig: Rig) -> None:
    for setting in SetStartSpeed(speed=1_000), SetMaximumSpeed(speed=20_000):
        await rig.body().ask(setting)
    await rig.body().ask(SetMaximumAcceleration(acceleration=50_000))


async def samples(rig: Rig, move: Move) -> BodySamples:
    return await samples_of(rig.plant.moves.trajectories.of(move.id))


@pytest.mark.parametrize(
    ("command", "end"),
    [
        (MoveClockwise(distance=40_000), 40_000),
        (MoveCounterclockwise(distance=40_000), -40_000),
        (MoveTo(position=-30_000), -30_000),
    ],
)
@in_virtual_time
async def test_the_measured_way_is_the_planned_one(command: RorzeCommand[Ack], end: int) -> None:
    async with rig() as it:
        await teach(it)
        told = await samples(it, await finished(it, command))
        assert told.note is None
        assert len(told.samples) > 5
        assert (told.samples[0].pulses, told.samples[-1].pulses) == (0, end)
        assert told.samples[-1].time_s > (told.planned_s or 0) - 1e-6 > 0
        for sample in told.samples:
            # 20 ms at 20,000 pulses a second
            assert sample.planned_pulses == pytest.approx(sample.pulses, abs=400)
        assert told.samples[-1].planned_pulses == end
        assert told.plan is not None
        assert (told.plan[0].pulses, told.plan[-1].pulses) == (0, end)
        assert told.plan[-1].time_s == told.planned_s
        fastest = max(told.plan, key=lambda it: abs(it.speed)).speed
        assert fastest == pytest.approx(20_000 if end > 0 else -20_000)


@in_virtual_time
async def test_more_is_read_where_the_line_is_told_so() -> None:
    async with rig(options=FAST) as it:
        await teach(it)
        told = await samples(it, await finished(it, MoveClockwise(distance=40_000)))
        assert len(told.samples) > 20 * (told.planned_s or 0)
        sent = len(it.wire.sent)
        await finished(it, MoveClockwise(distance=100), "00")
        asked_later = [frame for frame in it.wire.frames(sent) if frame == "&3F6PD"]
        assert len(asked_later) <= 1


@in_virtual_time
async def test_what_somebody_watches_is_kept_too() -> None:
    async with rig() as it:
        await teach(it)
        async with watching(it.plant.events, bodies=["3F"], types=["body.position"], sample=50):
            move = await finished(it, MoveClockwise(distance=40_000))
        assert len((await samples(it, move)).samples) > 60


@in_virtual_time
async def test_in_encoder_mode_both_are_counts() -> None:
    async with rig() as it:
        await teach(it)
        await it.body().ask(SetOperatingMode(mode="encoder"))
        await it.body().ask(SetEncoderRatio(ratio=2.0))
        it.axis().world.encoder *= 2
        told = await samples(it, await finished(it, MoveClockwise(distance=10_000)))
        assert told.samples[-1].planned_pulses == told.samples[-1].pulses == 10_000


@in_virtual_time
async def test_a_move_that_is_under_way_has_its_samples_until_now() -> None:
    async with rig() as it:
        await teach(it)
        move = await start(it, MoveClockwise(distance=40_000))
        trajectories = it.plant.moves.trajectories.of(move.id)
        assert len(trajectories.places) < 4
        told = await samples(it, move)
        assert told.note is None
        await ended(it, move)
        assert len(trajectories.places) > len(told.samples)


@in_virtual_time
async def test_there_is_no_plan_by_other_settings() -> None:
    async with rig() as it:
        await teach(it)
        move = await finished(it, MoveClockwise(distance=40_000))
        await it.body().ask(SetMaximumSpeed(speed=10_000))
        told = await samples(it, move)
        assert told.note == "Settings of the body may have changed since the move began."
        assert {sample.planned_pulses for sample in told.samples} == {None}


@in_virtual_time
async def test_a_plan_that_was_made_is_kept() -> None:
    async with rig() as it:
        await teach(it)
        move = await finished(it, MoveClockwise(distance=40_000))
        first = await samples(it, move)
        await it.body().ask(SetMaximumSpeed(speed=10_000))
        sent = len(it.wire.sent)
        assert await samples(it, move) == first
        assert len(it.wire.sent) == sent


@in_virtual_time
async def test_homing_has_samples_and_no_plan() -> None:
    async with rig() as it:
        await teach(it)
        told = await samples(it, await finished(it, Home()))
        assert told.samples
        assert told.note == "How far it goes was only known when it was done."


@in_virtual_time
async def test_a_body_that_cannot_be_asked_has_samples_all_the_same() -> None:
    async with rig() as it:
        await teach(it)
        move = await finished(it, MoveClockwise(distance=40_000))
        it.wire.unplug()
        told = await samples(it, move)
        assert len(told.samples) > 5
        assert told.note is not None
        assert told.note.startswith("The settings could not be read: ")
