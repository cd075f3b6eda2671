"""Software stops: ahead of everything, repeated until standstill is proved."""

import asyncio
from functools import partial

from gateway.core.family import Family
from gateway.core.rights import Right
from gateway.core.stops import StopMode
from gateway.core.supervisor import do_each
from gateway.core.targets import Stopped
from gateway.door.caller import for_caller, require
from gateway.plant import Plant


@for_caller
async def stop(plant: Plant, target: str, mode: StopMode) -> Stopped:
    """Stop a body, a group, or a robot; the frames are queued before anything is awaited.

    :raises GatewayError: there is no such target.
    """
    require(plant.access, Right.STOP)
    return await plant.target(target).stop(mode)


@for_caller
async def stop_all(plant: Plant, mode: StopMode) -> Stopped:
    """Stop everything; the frames are queued before anything is awaited."""
    require(plant.access, Right.STOP)
    stops = (partial(_begin, family, mode) for family in plant.packages.families.values())
    stopped = await asyncio.gather(*do_each("a stop", *stops).or_raise())
    return Stopped({name: those for stop in stopped for name, those in stop.reports.items()})


def _begin(family: Family, mode: StopMode) -> "asyncio.Future[Stopped]":
    return asyncio.ensure_future(family.stop_all(mode))
