"""Alarms: listed, and reset by people who have seen to them."""

from collections.abc import Sequence

from gateway.core.alarms import Alarm
from gateway.core.event_types import GATEWAY
from gateway.core.rights import Right
from gateway.operations.caller import for_caller, require
from gateway.plant import Plant
from gateway.security import entries


def listed(plant: Plant, *, standing: bool | None = None) -> Sequence[Alarm]:
    """Those that stand, then those that were reset; each newest first."""
    alarms = plant.alarms
    return [
        *([] if standing is False else alarms.standing()),
        *([] if standing is True else alarms.history()),
    ]


def get(plant: Plant, alarm_id: str) -> Alarm:
    """Find an alarm; errors as of `Alarms.get`."""
    found = plant.alarms.get(alarm_id)
    require(plant, Right.VIEW, *addresses_of(found))
    return found


def addresses_of(alarm: Alarm) -> list[str]:
    """What it is about; the whole plant, if none is named."""
    return [] if alarm.subject == GATEWAY else [alarm.subject.rpartition("/")[2]]


@for_caller
async def reset(plant: Plant, alarm_id: str) -> Alarm:
    """Reset an alarm: nothing moves, and nothing is sent; errors as of `Alarms.reset`."""
    require(plant, Right.OPERATE, *addresses_of(plant.alarms.get(alarm_id)), leased=False)
    alarm = plant.alarms.reset(alarm_id)
    plant.security.note(entries.ALARM_RESET, alarm.subject, alarm=alarm.id, cause=alarm.cause)
    return alarm
