"""Alarms: listed, and reset by people who have seen to them."""

from collections.abc import Sequence
from functools import partial

from gateway.core.alarm_boxes import boxed
from gateway.core.alarms import Alarm
from gateway.core.event_types import GATEWAY
from gateway.core.rights import Right
from gateway.fics.family import Fics
from gateway.operations.caller import for_caller, require
from gateway.plant import Plant
from gateway.security import entries


def listed(plant: Plant, *, standing: bool | None = None) -> Sequence[Alarm]:
    """Those that stand, then those that were reset; each newest first."""
    alarms = plant.alarms
    return [
        *([] if standing is False else boxed(alarms.standing(), partial(_line_of, plant))),
        *([] if standing is True else alarms.history()),
    ]


def _line_of(plant: Plant, subject: str) -> str | None:
    """The line behind a body, a group or a robot; None where nothing is configured any more, or ever was."""
    _, kind, address = subject.split("/", 2) if subject.count("/") > 1 else ("", "", "")
    if kind == "robots":
        return next((it.line.id for it in plant.family(Fics).robots() if it.id == address), None)
    return address.partition(".")[0] if kind in ("bodies", "groups") else None


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
