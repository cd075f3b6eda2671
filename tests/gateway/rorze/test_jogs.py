"""A body jogs for as long as its heartbeat comes, and no further than it may."""

import asyncio
from contextlib import suppress
from random import Random

import pytest

from gateway.core.errors import (
    BodyBusy,
    ControllerRefused,
    GatewayError,
    InvalidRequest,
    NotFound,
    StoppedFirst,
)
from gateway.core.jogs import HEARTBEAT_S, JogOutOfReach, JogOver
from gateway.core.move_record import MoveStatus
from gateway.rorze.jogs import LONGEST_S, BodyJogs
from gateway.rorze.move_requests import BodyJog, BodyJogRequest
from gateway.rorze.units import Length
from protocols.rorze.encoder import SetEncoderRatio
from protocols.rorze.modes import SetOperatingMode, SetSoftLimits
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.patterns import SetPattern
from protocols.rorze.speeds import (
    SetFallingAccelerationShare,
    SetMaximumAcceleration,
    SetMaximumSpeed,
    SetRisingAccelerationShare,
    SetStartSpeed,
)
from simulator.faults import Direction, Fault, Switch
from simulator.rorze.world import CW_LIMIT
from tests.plants import Rig, in_virtual_time, rig

SLOW, FAST = 1_000, 20_000
RIGHT = BodyJogRequest(direction="cw")


def jogs_of(it: Rig) -> BodyJogs:
    return it.plant.rorze.jogs


async def teach(it: Rig) -> None:
    """Set the standard speeds."""
    for setting in (
        SetStartSpeed(speed=SLOW),
        SetMaximumSpeed(speed=FAST),
        SetMaximumAcceleration(acceleration=50_000),
    ):
        await it.body().ask(setting)


async def started(it: Rig, request: BodyJogRequest = RIGHT) -> BodyJog:
    await teach(it)
    return await jogs_of(it).start(it.body(), request)


async def beat(it: Rig, jog: BodyJog, seconds: float) -> None:
    for _ in range(round(seconds / 0.4)):
        await asyncio.sleep(0.4)
        jogs_of(it).heartbeat(jog.id, it.body())


def runs(it: Rig) -> bool:
    return it.axis().motor.moving


@in_virtual_time
async def test_a_body_jogs_while_the_heartbeat_lasts_and_stands_when_it_is_ended() -> None:
    async with rig() as it:
        jog = await started(it)
        await beat(it, jog, 2.0)
        assert runs(it)
        ended = await jogs_of(it).end(jog.id, it.body())
        assert (ended.state, runs(it)) == ("ended", False)
        assert it.types("body.jog") == ["body.jog.started", "body.jog.stopping", "body.jog.ended"]
        move = it.plant.moves.get(jog.id)
        assert (move.status, move.kind, move.frame) == (MoveStatus.STOPPED, "jog", "&3F2+M10000\\r")
        assert await jogs_of(it).end(jog.id, it.body()) is ended


@in_virtual_time
async def test_without_a_heartbeat_the_motor_is_stopped_within_half_a_second() -> None:
    async with rig() as it:
        jog = await started(it)
        await asyncio.sleep(HEARTBEAT_S - 0.01)
        assert runs(it)
        sent = len(it.wire.sent)
        await asyncio.sleep(0.02)
        assert "&3F5SS" in it.wire.frames(sent)
        await asyncio.sleep(1.0)
        assert not runs(it)
        assert jog.state == "lost"
        with pytest.raises(JogOver, match=r"is over \(lost\)"):
            jogs_of(it).heartbeat(jog.id, it.body())
        [requested] = it.events("body.stop.requested")
        assert requested.data["request_id"] is None


@in_virtual_time
async def test_a_stop_of_the_body_ends_its_jog() -> None:
    async with rig() as it:
        jog = await started(it)
        await it.plant.stops.stop([it.body()], "immediate")
        await asyncio.sleep(1.0)
        assert it.types("body.jog")[-2:] == ["body.jog.stopping", "body.jog.stopped"]
        with pytest.raises(JogOver, match="stopped"):
            jogs_of(it).heartbeat(jog.id, it.body())


@in_virtual_time
async def test_a_stop_that_comes_while_the_speeds_are_read_lets_nothing_begin() -> None:
    async with rig(baud=9600) as it:
        await teach(it)
        starting = asyncio.create_task(jogs_of(it).start(it.body(), RIGHT))
        await it.wire.begun("&3FEPD")
        await it.plant.stops.stop([it.body()], "decelerate")
        with pytest.raises(StoppedFirst):
            await starting
        assert not it.executed("2+M")


@in_virtual_time
async def test_a_jog_nobody_ends_comes_no_further_than_ten_seconds_at_its_speed() -> None:
    async with rig() as it:
        jog = await started(it)
        assert jog.distance == LONGEST_S * SLOW
        with pytest.raises(JogOver, match="ended"):
            await beat(it, jog, 20.0)
        assert it.axis().position(asyncio.get_running_loop().time()) == 10_000


@in_virtual_time
async def test_the_speed_of_the_pattern_bounds_a_fast_jog() -> None:
    async with rig() as it:
        await teach(it)
        await it.body().ask(SetPattern(pattern=3, acceleration=5, deceleration=5))
        for setting in (
            SetStartSpeed(speed_set=5, speed=100),
            SetMaximumSpeed(speed_set=5, speed=3_000),
            SetMaximumAcceleration(speed_set=5, acceleration=10_000),
            SetRisingAccelerationShare(speed_set=5, percent=50),
            SetFallingAccelerationShare(speed_set=5, percent=50),
        ):
            await it.body().ask(setting)
        jog = await jogs_of(it).start(it.body(), BodyJogRequest(direction="-", speed="high", pattern=3))
        assert (jog.direction, jog.distance) == ("ccw", 30_000)
        assert it.executed("1-M")[0].facts["text"] == "1-MA[3],30000"


@in_virtual_time
async def test_the_client_may_bound_it_and_soft_limits_do() -> None:
    async with rig() as it:
        await teach(it)
        short = BodyJogRequest(direction="cw", at_most=Length(value=700, unit="pulse"))
        jog = await jogs_of(it).start(it.body(), short)
        await beat(it, jog, 0.4)
        await asyncio.sleep(1.0)
        assert jog.state == "ended"
        with pytest.raises(JogOver, match=r"is over \(ended\): it came to the end of its at_most; the axis"):
            jogs_of(it).heartbeat(jog.id, it.body())
        await it.body().ask(SetSoftLimits(lower=-100, upper=1_000))
        jog = await jogs_of(it).start(it.body(), RIGHT)
        assert jog.distance == 300
        await asyncio.sleep(2.0)
        with pytest.raises(JogOver, match="it came to its upper soft limit at 1000; the axis stands still"):
            jogs_of(it).heartbeat(jog.id, it.body())
        with pytest.raises(InvalidRequest, match="stands at 1000, its soft limits are -100 to 1000"):
            await jogs_of(it).start(it.body(), RIGHT)
        with pytest.raises(InvalidRequest, match="less than one pulse"):
            await jogs_of(it).start(
                it.body(), BodyJogRequest(direction="ccw", at_most=Length(value=0, unit="pulse"))
            )


@in_virtual_time
async def test_in_encoder_mode_the_distance_is_in_encoder_counts() -> None:
    async with rig() as it:
        await teach(it)
        await it.body().ask(SetEncoderRatio(ratio=2.0))
        await it.body().ask(SetOperatingMode(mode="encoder"))
        jog = await jogs_of(it).start(it.body(), RIGHT)
        assert jog.distance == LONGEST_S * SLOW / 2


@in_virtual_time
async def test_at_a_limit_sensor_it_ends_and_a_jog_onto_it_is_refused() -> None:
    async with rig() as it:
        jog = await started(it)
        await beat(it, jog, 0.8)
        it.touch(0x3F, lambda axis: axis.world.forced.update({CW_LIMIT: True}))
        await asyncio.sleep(0.4)
        assert (jog.state, it.plant.moves.get(jog.id).end_cause) == ("ended", "cw_limit")
        with pytest.raises(JogOver, match=r"is over \(ended\): it ran into its cw limit sensor; the axis"):
            jogs_of(it).heartbeat(jog.id, it.body())
        with pytest.raises(ControllerRefused):
            await jogs_of(it).start(it.body(), RIGHT)
        await asyncio.sleep(0.01)
        assert it.types("body.jog")[3:] == ["body.jog.started", "body.jog.stopping", "body.jog.ended"]


@in_virtual_time
async def test_a_body_that_moves_takes_no_jog_and_one_that_jogs_no_move() -> None:
    async with rig() as it:
        jog = await started(it)
        with pytest.raises(BodyBusy, match="still has the move"):
            await jogs_of(it).start(it.body(), RIGHT)
        with pytest.raises(BodyBusy):
            await it.plant.moves.start(it.body(), MoveClockwise(distance=5))
        assert jog.state == "jogging"
        with pytest.raises(NotFound):
            jogs_of(it).heartbeat(jog.id, it.body("00"))


@in_virtual_time
async def test_a_heartbeat_that_nobody_hears_keeps_nothing() -> None:
    async with rig() as it:
        jog = await started(it)
        it.wire.unplug()
        with pytest.raises(JogOutOfReach, match="may go on moving"):
            jogs_of(it).heartbeat(jog.id, it.body())
        await asyncio.sleep(1.0)
        assert (jog.state, jog.ends_as) == ("stopping", "lost")
        it.wire.plugged_in = True
        await asyncio.sleep(10.0)
        assert (jog.state, runs(it)) == ("lost", False)


@in_virtual_time
async def test_a_jog_whose_answer_is_lost_is_kept_and_stopped_all_the_same() -> None:
    async with rig() as it:
        await teach(it)
        starting = asyncio.create_task(jogs_of(it).start(it.body(), RIGHT))
        await it.wire.begun("&3F2+M10000")
        it.machine.faults.set(Switch(Fault.LOST, Direction.REPLIES, next_frames=1))
        jog = await starting
        await asyncio.sleep(3.0)
        assert (jog.state, runs(it)) == ("lost", False)


@in_virtual_time
async def test_the_end_of_the_gateway_stops_what_jogs() -> None:
    async with rig() as it:
        jog = await started(it)
        await it.plant.wind_down()
        assert (jog.state, runs(it)) == ("stopped", False)


@pytest.mark.parametrize("seed", range(40))
def test_whatever_happens_on_the_line_the_motor_stands_when_nobody_wants_it_to_move(seed: int) -> None:
    @in_virtual_time
    async def story() -> None:
        dice = Random(seed)
        async with rig(baud=dice.choice([None, 9600]), seed=seed) as it:
            await teach(it)
            for fault in (Fault.LOST, Fault.GARBLED, Fault.NOISE, Fault.LATE, Fault.DOUBLED):
                for direction in Direction:
                    it.machine.faults.set(
                        Switch(fault, direction, probability=dice.choice([0.0, 0.05, 0.2]), delay_s=0.3)
                    )
            with suppress(GatewayError):
                jog = await jogs_of(it).start(it.body(), RIGHT)
                for _ in range(dice.randrange(8)):
                    await asyncio.sleep(dice.uniform(0.1, 0.6))
                    jogs_of(it).heartbeat(jog.id, it.body())
                if dice.random() < 0.5:
                    await jogs_of(it).end(jog.id, it.body())
            it.machine.faults.clear()
            # Far less than the ten seconds after which its move would end.
            await asyncio.sleep(5.0)
            assert not runs(it)
            ends = [kind for kind in it.types("body.jog.") if kind.rpartition(".")[2] in ("ended", "lost")]
            assert len(ends) == len(it.types("body.jog.started"))

    story()
