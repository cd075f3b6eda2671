"""Alarms: listed, and reset by whoever has seen to them."""

from collections.abc import Sequence

from gateway.core.alarms import Alarm
from gateway.operations.caller import for_caller
from gateway.plant import Plant


def listed(plant: Plant, *, standing: bool | None = None) -> Sequence[Alarm]:
    """Those that stand, then those that were reset; each newest first."""
    alarms = plant.alarms
    return [
        *([] if standing is False else alarms.standing()),
        *([] if standing is True else alarms.history()),
    ]


def get(plant: Plant, alarm_id: str) -> Alarm:
    """Find an alarm; errors as of `Alarms.get`."""
    return plant.alarms.get(alarm_id)


@for_caller
async def reset(plant: Plant, alarm_id: str) -> Alarm:
    """Reset an alarm: nothing moves, and nothing is sent; errors as of `Alarms.reset`."""
    return plant.alarms.reset(alarm_id)
