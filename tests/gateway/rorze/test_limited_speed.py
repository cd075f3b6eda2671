"""A move with a highest speed of its own runs no faster, and leaves the speeds that a user has set."""

import asyncio

import pytest
from pydantic import ValidationError

from gateway.core.errors import BodyBusy, InvalidRequest, StoppedFirst
from gateway.core.origin import Origin
from gateway.core.targets import BegunMoves
from gateway.rorze.move_requests import AbsoluteMoveRequest, BodyJogRequest, RelativeMoveRequest
from gateway.rorze.plans import PlannedMove, Rate
from gateway.rorze.speed_sets import SpeedSetWanted, change_set, read_set
from gateway.rorze.units import Length
from protocols.rorze.patterns import SetPattern, SetSpeedChange
from tests.plants import Rig, in_virtual_time, rig
from tests.through_the_door import start

ME = Origin("test")
SCALED = 'units = {unit = "mm", pulses_per_unit = 100.0}'
FIVE = Rate(value=5, unit="mm/s")

THEIRS = SpeedSetWanted(
    start_speed_pps=50,
    maximum_speed_pps=9_000,
    acceleration_pps_s=7_000,
    rising_percent=10,
    falling_percent=10,
)


def by_mm(value: float, limit: Rate = FIVE, *, validate_only: bool = False) -> RelativeMoveRequest:
    return RelativeMoveRequest(
        kind="relative",
        direction="cw",
        distance=Length(value=value, unit="mm"),
        max_speed=limit,
        validate_only=validate_only,
    )


async def fastest(it: Rig, seconds: float) -> float:
    """The greatest speed of the motor, in pulses a second, seen over a time."""
    most = 0.0
    for _ in range(round(seconds / 0.05)):
        before = place(it)
        await asyncio.sleep(0.05)
        most = max(most, abs(place(it) - before) / 0.05)
    return most


def place(it: Rig) -> int:
    """Where the motor is, in pulses."""
    return it.axis().motor.pulses(asyncio.get_running_loop().time())


@in_virtual_time
async def test_a_jog_held_for_three_seconds_comes_as_far_as_its_speed_says() -> None:
    async with rig(body_options=SCALED) as it:
        jogs = it.plant.rorze.jogs
        jog = await jogs.start(it.body(), BodyJogRequest(direction="cw", speed="high", max_speed=FIVE))
        assert it.plant.moves.get(jog.id).frame.startswith("&3F1+MA[29],")
        for _ in range(8):
            assert await fastest(it, 0.4) <= 520
            jogs.heartbeat(jog.id, it.body())
        await jogs.end(jog.id, it.body())
        assert 1_000 < place(it) < 1_750  # at 500 mm/s it would be 150,000


@in_virtual_time
async def test_a_step_and_a_way_to_a_place_run_no_faster_than_asked_for() -> None:
    async with rig(body_options=SCALED) as it:
        for request in (
            by_mm(10),
            AbsoluteMoveRequest(
                kind="absolute",
                position=Length(value=0, unit="mm"),
                max_speed=Rate(value=500, unit="pulse/s"),
            ),
        ):
            begun = await start(it.plant, ME, "/bodies/3F", request)
            assert isinstance(begun, BegunMoves)
            assert 450 < await fastest(it, 1.0) <= 520
            assert (await it.plant.moves.wait(begun.moves[0].id, 60)).status == "succeeded"


@in_virtual_time
async def test_the_standard_speeds_bound_it_and_stay_as_they_were() -> None:
    async with rig(body_options=SCALED) as it:
        before = await read_set(it.body(), 30)
        begun = await start(it.plant, ME, "/bodies/3F", by_mm(10, Rate(value=9_999, unit="mm/s")), 30.0)
        assert isinstance(begun, BegunMoves)
        assert await read_set(it.body(), 30) == before
        own = await read_set(it.body(), 29)
        assert own.maximum_speed_pps == before.maximum_speed_pps


@in_virtual_time
async def test_a_pattern_that_somebody_has_set_is_not_overwritten() -> None:
    async with rig(body_options=SCALED) as it:
        await change_set(it.body(), 29, THEIRS, None, flash=False)
        with pytest.raises(InvalidRequest, match="would overwrite them; nothing was changed"):
            await start(it.plant, ME, "/bodies/3F", by_mm(10))
        assert (await read_set(it.body(), 29)).maximum_speed_pps == 9_000
        assert not it.executed("1+M")


@in_virtual_time
async def test_the_pattern_of_the_configuration_is_the_gateways_and_loses_its_changes_of_speed() -> None:
    async with rig(body_options=f"{SCALED}, slow_pattern = 7") as it:
        await change_set(it.body(), 3, THEIRS, None, flash=False)
        await it.body().ask(SetPattern(pattern=7, acceleration=3, deceleration=3))
        await it.body().ask(SetSpeedChange(pattern=7, point=0, begin=100, speed=40_000))
        begun = await start(it.plant, ME, "/bodies/3F", by_mm(10))
        assert isinstance(begun, BegunMoves)
        assert begun.moves[0].frame == "&3F1+MA[7],1000\\r"
        assert await fastest(it, 2.5) <= 520


@in_virtual_time
async def test_of_two_wishes_at_once_the_second_changes_no_speed_of_the_first() -> None:
    async with rig(body_options=SCALED) as it:
        fast = Rate(value=400, unit="mm/s")
        starts = [start(it.plant, ME, "/bodies/3F", by_mm(10, limit)) for limit in (FIVE, fast)]
        first, second = await asyncio.gather(*starts, return_exceptions=True)
        assert isinstance(first, BegunMoves)
        assert isinstance(second, BodyBusy)
        assert await fastest(it, 1.0) <= 520
        with pytest.raises(BodyBusy):
            await start(it.plant, ME, "/bodies/3F", by_mm(10, fast))
        assert await fastest(it, 0.5) <= 520


@in_virtual_time
async def test_a_stop_while_the_speed_is_written_lets_nothing_begin() -> None:
    async with rig(baud=9600, body_options=SCALED) as it:
        starting = asyncio.create_task(start(it.plant, ME, "/bodies/3F", by_mm(10)))
        await it.wire.begun("&3FOLDS[29]")
        await it.plant.stops.stop([it.body()], "decelerate")
        with pytest.raises(StoppedFirst):
            await starting
        assert not it.executed("1+M")


@in_virtual_time
async def test_what_is_only_validated_writes_nothing_and_knows_how_long_it_takes() -> None:
    async with rig(body_options=SCALED) as it:
        plan = await start(it.plant, ME, "/bodies/3F", by_mm(10, validate_only=True))
        assert isinstance(plan, PlannedMove)
        assert plan.frame == "&3F1+MA[29],1000\\r"
        assert plan.duration_s == pytest.approx(2.0, abs=0.1)
        assert not [frame for frame in it.wire.frames() if "OHS" in frame]


def test_one_move_has_one_speed() -> None:
    for other in ({"pattern": 3}, {"speed": "low"}):
        with pytest.raises(ValidationError, match="cannot be given together"):
            BodyJogRequest(direction="cw", max_speed=FIVE, **{"speed": "high", **other})  # type: ignore[arg-type]
