"""The audit over HTTP: who did what, and what became of it."""

from collections.abc import Sequence
from typing import Annotated

from fastapi import Query, Request, Response
from pydantic import AwareDatetime, BaseModel, Field

from api.common.requests import json_response, new_router, plant_of
from gateway.core.aside import aside
from gateway.core.rights import Right
from gateway.operations import audit
from gateway.operations.audit import Deed, Wanted

router = new_router("audit")


class Audit(BaseModel):
    """Deeds, the newest first."""

    deeds: list[Deed]
    cursor: str | None = Field(description="Give it as `cursor` for older ones; null where there are none.")


@router.get("/audit", Right.VIEW, any_scope=True, response_model=Audit)
async def list_deeds(
    request: Request,
    caller: Annotated[
        str | None, Query(description="Only those of callers whose name has this in it.")
    ] = None,
    target: Annotated[
        str | None,
        Query(description="Only those for this body or group with its line, or robot: arm.3F, r1."),
    ] = None,
    since: Annotated[AwareDatetime | None, Query(description="Only those not before this time.")] = None,
    until: Annotated[AwareDatetime | None, Query(description="Only those before this time.")] = None,
    cursor: Annotated[
        str | None, Query(pattern="^[0-9a-f]{20}$", description="Only those older than this cursor.")
    ] = None,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> Response:
    """List all that had an effect, or was to have one, over restarts: caller, target, command and outcome.

    A key with a scope names a target in it.
    """
    wanted = Wanted(caller, target, since, until, cursor)
    found = await audit.deeds(plant_of(request), wanted, limit)
    return await aside(_told, found, limit)


def _told(found: Sequence[Deed], limit: int) -> Response:
    return json_response(Audit(deeds=list(found), cursor=found[-1].id if len(found) == limit else None))
