"""A fault of the gateway itself, at any place, lets no motor jog on without its heartbeat."""

import asyncio
from contextlib import suppress
from typing import Any

import pytest

from gateway.core.jogs import JogNews
from gateway.core.move_runs import MoveRun
from gateway.core.stops import Stopping
from gateway.fics.jogs import RobotJogs
from gateway.fics.motion_state import MotionState
from gateway.rorze.bodies import Body
from gateway.rorze.jogs import BodyJogs
from gateway.rorze.move_requests import BodyJogRequest
from gateway.rorze.stops import Stops, _BodyStop
from protocols.fics.homing import HomeRobot
from protocols.rorze.speeds import SetMaximumAcceleration, SetMaximumSpeed, SetStartSpeed
from tests.fics_plants import FicsRig, fics_rig
from tests.own_faults import Place, fail_once, named
from tests.plants import Rig, in_virtual_time, rig

STOPPED_WITHIN_S = 2.0
"""Seconds from the last heartbeat: half a second, and the longest way to a standstill."""
SEEN_WITHIN_S = 10.0
OF_BODIES = [
    (Body, "was_set_going"),
    (MoveRun, "advance"),
    (BodyJogs, "_begin"),
    (BodyJogs, "_see_over"),
    (Stops, "_forbid_what_waits"),
    (Stops, "_begin"),
    (_BodyStop, "submit"),
    (Stopping, "tell"),
]
LEFT_ALONE = [(BodyJogs, "_missed"), (BodyJogs, "_stop"), (BodyJogs, "_see_to")]
OF_ROBOTS = [
    (MotionState, "begin"),
    (RobotJogs, "_begin"),
    (RobotJogs, "_see_to"),
    (RobotJogs, "_stop"),
    (RobotJogs, "_see_still"),
    (RobotJogs, "_settled"),
]
ROBOTS_LEFT_ALONE = [(RobotJogs, "_missed"), (RobotJogs, "_take")]


def either_way(places: list[Place], left_alone: list[Place]) -> list[Any]:
    """Places with whether the jog is ended, or its heartbeat stays away."""
    wanted = [(place, ended) for place in places for ended in (False, True)]
    wanted += [(place, False) for place in left_alone]
    ways = {False: "left_alone", True: "ended"}
    return [pytest.param(place, ended, id=f"{named(place)}-{ways[ended]}") for place, ended in wanted]


async def body_jogs(it: Rig, *, ended: bool) -> None:
    """Jog, and say no more, or end it."""
    jogs = it.plant.rorze.jogs
    with suppress(Exception):
        jog = await jogs.start(it.body(), BodyJogRequest(direction="cw"))
        await asyncio.sleep(0.3)
        if ended:
            await jogs.end(jog.id, it.body())


async def robot_jogs(it: FicsRig, *, ended: bool) -> None:
    """Jog, and say no more, or end it."""
    jogs = it.robot.jogs
    with suppress(Exception):
        jog = await jogs.start(1, "Z", "-")
        await asyncio.sleep(0.3)
        if ended:
            await jogs.end(jog.id)


@pytest.mark.parametrize(("place", "ended"), either_way(OF_BODIES, LEFT_ALONE))
@in_virtual_time
async def test_a_body_does_not_jog_on(place: Place, ended: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    async with rig(groups={}) as it:
        for setting in (
            SetStartSpeed(speed=1_000),
            SetMaximumSpeed(speed=20_000),
            SetMaximumAcceleration(acceleration=50_000),
        ):
            await it.body().ask(setting)
        fail_once(monkeypatch, place)
        await body_jogs(it, ended=ended)
        await asyncio.sleep(STOPPED_WITHIN_S)
        assert not it.axis().motor.moving
        await asyncio.sleep(SEEN_WITHIN_S)
        monkeypatch.undo()
        jog = await it.plant.rorze.jogs.start(it.body(), BodyJogRequest(direction="ccw"))
        assert (await it.plant.rorze.jogs.end(jog.id, it.body())).state == "ended"
        [report] = await it.plant.stops.stop([it.body()], "immediate")
        assert report.state == "confirmed"


@pytest.mark.parametrize(("place", "ended"), either_way(OF_ROBOTS, ROBOTS_LEFT_ALONE))
@pytest.mark.parametrize("mode", [2, 3])
def test_an_axis_of_a_robot_does_not_jog_on(
    mode: int, place: Place, ended: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as it:
            await it.move(HomeRobot())
            fail_once(monkeypatch, place)
            await robot_jogs(it, ended=ended)
            await asyncio.sleep(STOPPED_WITHIN_S)
            assert it.fics.job is None
            await asyncio.sleep(SEEN_WITHIN_S)
            monkeypatch.undo()
            assert not it.robot.power_cycled
            jog = await it.robot.jogs.start(1, "Z", "+")
            assert (await it.robot.jogs.end(jog.id)).state == "ended"
            assert (await it.robot.stop("decelerate")).state == "confirmed"

    story()


@in_virtual_time
async def test_one_jog_that_a_fault_meets_keeps_no_other_from_being_stopped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with rig(groups={}) as it:
        jogs = it.plant.rorze.jogs
        for body in it.plant.bodies():
            await jogs.start(body, BodyJogRequest(direction="cw"))
        fail_once(monkeypatch, (BodyJogs, "_see_to"))
        jogs.end_all(JogNews.MISSED)
        await asyncio.sleep(0.4)
        assert not any(axis.motor.moving for axis in it.machine.axes.values())
