"""Software stops: ahead of everything, repeated until standstill is proved."""

import asyncio

from gateway.core.rights import Right
from gateway.core.stops import StopMode
from gateway.core.targets import Stopped
from gateway.operations.caller import needs
from gateway.plant import Plant


@needs(Right.STOP)
async def stop(plant: Plant, target: str, mode: StopMode) -> Stopped:
    """Stop a body, a group, or a robot; the frames are queued before anything is awaited.

    :raises GatewayError: there is no such target.
    """
    return await plant.target(target).stop(mode)


@needs(Right.STOP, whole_plant=True)
async def stop_all(plant: Plant, mode: StopMode) -> Stopped:
    """Stop everything; the frames are queued before anything is awaited."""
    stopped = await asyncio.gather(*[family.stop_all(mode) for family in plant.families.values()])
    return Stopped({name: those for it in stopped for name, those in it.reports.items()})
