"""A full line: 120 bodies at 9600 baud."""

import asyncio
from collections.abc import AsyncIterator, Iterable
from contextlib import asynccontextmanager

from protocols.rorze.speeds import SetMaximumAcceleration, SetMaximumSpeed, SetStartSpeed
from tests.plants import Rig, Wire, rig

FULL = range(120)
SWEEP_GROUPS = 'sweep_groups = ["90", "9E"]'


@asynccontextmanager
async def full_line(
    options: str = SWEEP_GROUPS, *, bodies: range = FULL, wire: type[Wire] = Wire
) -> AsyncIterator[Rig]:
    """Start one that is known throughout."""
    async with rig(bodies=bodies, groups={}, baud=9600, options=options, wire=wire) as running:
        sweep = running.plant.rorze.sweep_of(running.plant.rorze.lines["line1"])
        while sweep.groups and not all(map(sweep.covers, running.plant.bodies())):  # noqa: ASYNC110  # no event
            await asyncio.sleep(0.1)
        yield running


def busy_s(rig: Rig, since: float) -> float:
    """Seconds for which questions and replies were on the wire, one after the other."""
    asked = sum(len(it.frame) + 1 for it in rig.wire.sent if it.at >= since)
    told = sum(len(data) for at, data in rig.wire.heard if at >= since)
    return (asked + told) * rig.wire.byte_time_s


async def teach(rig: Rig, bodies: Iterable[str]) -> None:
    """Set the speeds of bodies."""
    for body in map(rig.body, bodies):
        await body.ask(SetStartSpeed(speed=1_000))
        await body.ask(SetMaximumSpeed(speed=5_000))
        await body.ask(SetMaximumAcceleration(acceleration=100_000))
