"""Plans say beforehand what the motor then does."""

import pytest

from gateway.core.errors import ControllerRefused
from gateway.rorze.plans import PlannedMove, plan_of
from protocols.rorze.encoder import SetEncoderRatio
from protocols.rorze.modes import SetOperatingMode, SetSoftLimits
from protocols.rorze.moves import MoveClockwise, MoveClockwiseSlowly, MoveCounterclockwise, MoveTo
from protocols.rorze.notation import PositionReference
from protocols.rorze.origin import Home
from protocols.rorze.patterns import SetPattern, SetSpeedChange
from protocols.rorze.position_table import SetPositionEntry
from protocols.rorze.row import RorzeCommand
from protocols.rorze.speeds import (
    SetFallingAccelerationShare,
    SetMaximumAcceleration,
    SetMaximumSpeed,
    SetRisingAccelerationShare,
    SetStartSpeed,
)
from protocols.table import Ack
from tests.plants import Rig, in_virtual_time, rig


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (MoveTo(position=5_001), "the target 5001 lies beyond its upper soft limit 5000 (pulses)"),
        (
            MoveCounterclockwise(distance=101),
            "the target -101 lies beyond its lower soft limit -100 (pulses)",
        ),
        (MoveTo(position=5_000), None),
    ],
)
def test_what_the_soft_limits_refuse_is_noted_as_the_move_is_refused(
    command: RorzeCommand[Ack], words: str | None
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with rig() as it:
            await it.body().ask(SetSoftLimits(lower=-100, upper=5_000))
            planned = await plan_of(it.body(), command)
            if words is None:
                assert planned.note is None
                return
            assert planned.note == f"It would be refused: {words}."
            assert planned.duration_s is None
            with pytest.raises(ControllerRefused) as refusal:
                await it.plant.moves.start(it.body(), command)
            assert words in refusal.value.detail

    story()


async def prepare(rig: Rig) -> None:
    """Give pattern 12 speed parameters of its own, and pattern 13 a change of speed besides."""
    settings: list[RorzeCommand[Ack]] = []
    for speed_set, high in ((1, 30_000), (2, 30_000)):
        settings += [
            SetStartSpeed(speed_set=speed_set, speed=500 * speed_set),
            SetMaximumSpeed(speed_set=speed_set, speed=high),
            SetMaximumAcceleration(speed_set=speed_set, acceleration=60_000 * speed_set),
            SetRisingAccelerationShare(speed_set=speed_set, percent=40),
            SetFallingAccelerationShare(speed_set=speed_set, percent=60),
        ]
    settings += [
        SetPattern(pattern=12, acceleration=1, deceleration=2),
        SetPattern(pattern=13, acceleration=1, deceleration=2),
        SetSpeedChange(pattern=13, point=3, begin=20_000, speed=10_000),
        SetSpeedChange(pattern=13, point=7, begin=40_000, speed=30_000),
        SetPositionEntry(entry=PositionReference(position=25), pulses=-7_000),
    ]
    for setting in settings:
        await rig.body().ask(setting)


@pytest.mark.parametrize(
    ("command", "distance"),
    [
        (MoveClockwise(distance=50_000), 50_000),
        (MoveClockwise(distance=300), 300),
        (MoveCounterclockwise(distance=50_000, pattern=12), 50_000),
        (MoveClockwise(distance=90_000, pattern=13), 90_000),
        (MoveClockwiseSlowly(distance=2_000, pattern=12), 2_000),
        (MoveClockwiseSlowly(distance=90_000, pattern=13), 90_000),
        (MoveTo(position=-20_000), 20_000),
        (MoveTo(position=PositionReference(position=25), pattern=12), 7_000),
    ],
)
@in_virtual_time
async def test_the_planned_duration_is_that_of_the_pulses(command: RorzeCommand[Ack], distance: int) -> None:
    async with rig() as it:
        await prepare(it)
        planned = await plan_of(it.body(), command)
        assert not it.truth.of("pulses_start")
        [move] = await it.plant.moves.start(it.body(), command)
        await it.plant.moves.wait(move.id, 200.0)
        [begun], [over] = it.truth.of("pulses_start"), it.truth.of("pulses_stop")
        assert planned.distance == distance
        assert planned.target_position == move.target_position == move.position
        assert planned.duration_s == pytest.approx(over.at - begun.at, abs=1e-9)
        assert planned.frame == move.frame
        assert planned.note is None


@in_virtual_time
async def test_in_encoder_mode_the_distance_counts_encoder_steps() -> None:
    async with rig() as it:
        await it.body().ask(SetOperatingMode(mode="encoder"))
        await it.body().ask(SetEncoderRatio(ratio=2.5))
        command = MoveClockwise(distance=1_000)
        planned = await plan_of(it.body(), command)
        assert (planned.distance, planned.target_position) == (2_500, 1_000)
        assert planned.counted_in == "encoder_counts"
        [move] = await it.plant.moves.start(it.body(), command)
        await it.plant.moves.wait(move.id, 60.0)
        [begun], [over] = it.truth.of("pulses_start"), it.truth.of("pulses_stop")
        assert planned.duration_s == pytest.approx(over.at - begun.at, abs=1e-9)


@in_virtual_time
async def test_a_move_to_where_the_motor_stands_takes_no_time() -> None:
    async with rig() as it:
        planned = await plan_of(it.body(), MoveTo(position=0))
        assert (planned.distance, planned.duration_s) == (0, 0.0)


@pytest.mark.parametrize("command", [Home(), MoveClockwise(distance="endless")])
@in_virtual_time
async def test_what_only_the_motion_can_tell_is_not_guessed(command: RorzeCommand[Ack]) -> None:
    async with rig() as it:
        planned = await plan_of(it.body(), command)
        assert (planned.distance, planned.target_position, planned.duration_s) == (None, None, None)
        assert planned.note is not None


@pytest.mark.parametrize(
    "command",
    [
        MoveClockwise(distance=100, pattern=29),
        MoveClockwise(distance=10_000, pattern=13),
        MoveClockwiseSlowly(distance=10_000, pattern=13),
    ],
)
@in_virtual_time
async def test_a_move_that_would_be_refused_says_so(command: RorzeCommand[Ack]) -> None:
    async with rig() as it:
        await prepare(it)
        planned = await plan_of(it.body(), command)
        with pytest.raises(ControllerRefused):
            await it.plant.moves.start(it.body(), command)
        assert isinstance(planned, PlannedMove)
        assert planned.duration_s is None
        assert planned.note is not None
        assert planned.note.startswith("It would be refused")
