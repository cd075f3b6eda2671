"""Alarms over HTTP: what has gone wrong, what the motor did, what to do next; and their reset."""

from typing import Annotated

from fastapi import Query, Request, Response
from pydantic import BaseModel

from api.common.requests import is_seen, json_response, new_router, origin, plant_of
from gateway.access.principal import current
from gateway.core.alarms import Alarm
from gateway.core.rights import Right
from gateway.operations import alarms

router = new_router("alarms")


class AlarmList(BaseModel):
    """Alarms: those that stand first, then those that were reset, each newest first."""

    alarms: list[Alarm]


@router.get("/alarms", Right.VIEW, any_scope=True, response_model=AlarmList)
async def list_alarms(
    request: Request,
    standing: Annotated[
        bool | None, Query(description="Only those that stand, or only those that were reset.")
    ] = None,
    limit: Annotated[int, Query(ge=1, le=2000)] = 100,
) -> Response:
    """List alarms over restarts: what has happened, what the motor did, and the calls that help."""
    found = alarms.listed(plant_of(request), standing=standing)
    return json_response(AlarmList(alarms=[it for it in found if _is_seen(request, it)][:limit]))


@router.get("/alarms/{alarm_id}", Right.VIEW, any_scope=True, response_model=Alarm)
async def get_alarm(request: Request, alarm_id: str) -> Response:
    """Get an alarm."""
    return json_response(alarms.get(plant_of(request), alarm_id))


@router.post("/alarms/{alarm_id}/reset", Right.OPERATE, any_scope=True, response_model=Alarm)
async def reset_alarm(request: Request, alarm_id: str) -> Response:
    """Reset an alarm, once its cause is over. Nothing moves, and nothing is sent."""
    return json_response(await alarms.reset(plant_of(request), origin(), alarm_id))


def _is_seen(request: Request, alarm: Alarm) -> bool:
    """Keys with a scope see what it covers; what is about the gateway is about the whole plant."""
    return current().scope is None or any(is_seen(request, it) for it in alarms.addresses_of(alarm))
