"""Alarms: what has gone wrong, what the motor did, what to do next; and their reset."""

from collections.abc import Sequence
from functools import partial
from typing import Annotated, Final

from pydantic import Field

from gateway.access import principal
from gateway.core.alarm_boxes import boxed
from gateway.core.alarms import Alarm
from gateway.core.operation import Rows
from gateway.core.parts import GATEWAY
from gateway.core.records import AnswerModel
from gateway.core.rights import Right
from gateway.door.caller import require, sees
from gateway.door.names import COLLECTIONS
from gateway.plant import Plant
from gateway.security import entries

ROWS: Final = Rows("alarms")


class AlarmList(AnswerModel):
    """Alarms: those that stand first, then those that were reset, each newest first."""

    alarms: list[Alarm]


@ROWS.get("/alarms", any_scope=True)
async def list_alarms(
    plant: Plant,
    *,
    standing: Annotated[
        bool | None, Field(description="True for standing alarms only, false for those that were reset only.")
    ] = None,
    limit: Annotated[int, Field(ge=1, le=2000)] = 100,
) -> AlarmList:
    """List alarms, over restarts: the event, the motor's reaction, and the calls that help."""
    found = listed(plant, standing=standing)
    return AlarmList(alarms=[alarm for alarm in found if _is_seen(plant, alarm)][:limit])


@ROWS.get("/alarms/{alarm_id}", any_scope=True)
async def get_alarm(plant: Plant, alarm_id: str) -> Alarm:
    """Get an alarm."""
    found = plant.alarms.get(alarm_id)
    require(plant.access, Right.VIEW, *_addresses_of(found))
    return found


@ROWS.post("/alarms/{alarm_id}/reset", Right.OPERATE, any_scope=True, leased=False)
async def reset_alarm(plant: Plant, alarm_id: str) -> Alarm:
    """Reset an alarm, once its cause is over. Nothing moves, and nothing is sent."""
    require(plant.access, Right.OPERATE, *_addresses_of(plant.alarms.get(alarm_id)), leased=False)
    alarm = plant.alarms.reset(alarm_id)
    plant.access.security.note(entries.ALARM_RESET, alarm.subject, alarm=alarm.id, cause=alarm.cause)
    return alarm


def listed(plant: Plant, *, standing: bool | None = None) -> Sequence[Alarm]:
    """List alarms that stand, then alarms that were reset; each newest first."""
    alarms = plant.alarms
    return [
        *([] if standing is False else boxed(alarms.standing(), partial(_line_of, plant))),
        *([] if standing is True else alarms.history()),
    ]


def _line_of(plant: Plant, subject: str) -> str | None:
    """The line behind a body, a group or a robot; None where nothing is configured any more, or ever was."""
    kind, slash, address = subject.removeprefix("/").partition("/")
    if not slash or "/" in address or f"/{kind}" not in COLLECTIONS:
        return None
    line_id, dot, _ = address.partition(".")
    return line_id if dot else next((part.line_id for part in plant.access.territory.parts(address)), None)


def _is_seen(plant: Plant, alarm: Alarm) -> bool:
    """Keys with a scope see what it covers; what is about the gateway is about the whole plant."""
    return principal.current().scope is None or any(
        sees(plant.access, address) for address in _addresses_of(alarm)
    )


def _addresses_of(alarm: Alarm) -> list[str]:
    """Address of the part that an alarm is about; none means the whole plant."""
    return [] if alarm.subject == GATEWAY else [alarm.subject.rpartition("/")[2]]
