"""Stops on a bad wire: what is called confirmed stands still, and every stop comes to that.

Commands and replies are lost, replies garbled; the simulator's truth is the judge. A seed that fails is
named in the test's id.
"""

import asyncio
from contextlib import suppress
from functools import partial
from random import Random

import pytest

from gateway.core.errors import GatewayError
from gateway.core.stops import StopMode
from gateway.rorze.bodies import Body
from gateway.rorze.stops import StopReport
from protocols.rorze.moves import MoveClockwiseSlowly
from simulator.faults import Direction, Fault, Switch
from tests.drawing import drawn
from tests.gateway.rorze.far_end import until
from tests.plants import Rig, rig
from tests.virtual_time import run_virtual

SEEDS = range(4)
STOPS = 40
LONGEST_S = 120.0
"""A stop that is never confirmed fails the test instead of keeping it."""
MODES: tuple[StopMode, ...] = ("decelerate", "immediate")

BAD_WIRE = (
    Switch(Fault.LOST, Direction.REQUESTS, 0.05),
    Switch(Fault.LOST, Direction.REPLIES, 0.05),
    Switch(Fault.GARBLED, Direction.REPLIES, 0.02),
)


def confirmed(reports: list[StopReport]) -> bool:
    """Say whether every stop has come to its end."""
    return all(report.state == "confirmed" for report in reports)


async def stop_some(stand: Rig, bodies: list[Body], mode: StopMode) -> None:
    """Stop bodies, and look at the truth when they are said to stand still."""
    reports = await stand.plant.stops.stop(bodies, mode)
    await until(partial(confirmed, reports), LONGEST_S)
    for report in reports:
        body = stand.body(report.body_id)
        assert not stand.axis(body.number).motor.moving, report
    assert stand.plant.line("line1").waiting()["stop_repeat"] == 0, "it would stop the next move"


async def story(seed: int) -> Rig:
    """Let bodies move, and stop some of them again and again."""
    dice = Random(seed)
    async with rig(bodies=range(6), groups={"80": ("00", "01", "02")}, baud=115_200, seed=seed) as stand:
        for switch in BAD_WIRE:
            stand.machine.faults.set(switch)
        for _ in range(STOPS):
            for body in dice.sample(stand.plant.bodies(), 3):
                with suppress(GatewayError):
                    await stand.plant.moves.start(body, MoveClockwiseSlowly(distance=100_000))
            await asyncio.sleep(dice.uniform(0.0, 1.0))
            await stop_some(stand, dice.sample(stand.plant.bodies(), dice.randint(1, 6)), dice.choice(MODES))
        return stand


@pytest.mark.parametrize("seed", drawn(SEEDS, 1, "faulty_stops"))
def test_what_is_said_to_stand_still_does(seed: int) -> None:
    stand = run_virtual(story(seed))
    assert len(stand.types("body.stop.confirmed")) == len(stand.types("body.stop.requested")) >= STOPS
    assert len(stand.truth.of("pulses_start")) > STOPS
