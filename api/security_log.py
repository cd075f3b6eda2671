"""The security log over HTTP: who was let in, who was refused, and who changed who may do what."""

from typing import Annotated

from fastapi import Query, Request, Response
from pydantic import BaseModel, Field

from api.common.requests import json_response, new_router, origin, plant_of
from gateway.core.rights import Right
from gateway.operations import security
from gateway.security.entries import Entry

router = new_router("security log")


class SecurityEntries(BaseModel):
    """Entries, the newest first."""

    entries: list[Entry]
    cursor: int | None = Field(
        description="The number to give as `cursor` for older ones; null where there are none."
    )


@router.get("/security", Right.ADMIN, response_model=SecurityEntries)
async def list_security_entries(
    request: Request,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
    cursor: Annotated[int | None, Query(ge=1, description="Only those older than this cursor.")] = None,
) -> Response:
    """List the security log: sign-ins, refusals, keys, sessions, leases, reloads and what else needs a name.

    No use of the gateway pushes an entry out; what comes in a flood is counted in one.
    """
    found = list(await security.newest(plant_of(request), origin(), limit, cursor))
    older = found[-1].number if len(found) == limit and found[-1].number > 1 else None
    return json_response(SecurityEntries(entries=found, cursor=older))
