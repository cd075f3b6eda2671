"""Leases over HTTP: taken, renewed within their time, and given back."""

from typing import Annotated

from fastapi import Path, Request, Response
from pydantic import BaseModel, Field

from api.common.requests import json_response, new_router, origin, plant_of
from gateway.core.leases import LONGEST_S, Lease, Taken
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.operations import leases

router = new_router("leases")

LeaseId = Annotated[str, Path(description="The id of a lease.", examples=["lease-1"])]


class LeaseRequest(RequestModel, json_schema_extra=example(scope="line1.3F", ttl_s=10.0)):
    """What to lease, and for how long."""

    scope: str = Field(
        pattern="^[A-Za-z0-9.-]{1,64}$", description="The address of a line, a body, a group or a robot."
    )
    ttl_s: float = Field(
        10.0, ge=0.5, le=LONGEST_S, description="In seconds; it ends then, unless it is renewed before."
    )
    take_over: bool = Field(
        default=False, description="End the leases of others that are in the way; takes the right `admin`."
    )


class LeaseList(BaseModel):
    """All leases that last."""

    leases: list[Lease]


@router.get("/leases", Right.VIEW, any_scope=True, response_model=LeaseList)
async def list_leases(request: Request) -> Response:
    """List who has leased what; a key with a scope sees those within it."""
    return json_response(LeaseList(leases=leases.seen(plant_of(request))))


@router.post("/leases", Right.OPERATE, any_scope=True, status_code=201, response_model=Taken)
async def take_lease(request: Request, lease: LeaseRequest) -> Response:
    """Lease a line, a body, a group or a robot: until it ends, nobody else moves or sets what is in it.

    Its holder sends its `token` as the header `Lease-Token` with each motion and each setting; several
    tokens stand side by side with commas. A token that is not good any more is refused though nobody else has
    a lease. Reads and stops need none. When it ends, moves go on to their ends, and what would never end (a
    JOG, a move without an end) is stopped.
    """
    taken = await leases.take(
        plant_of(request), origin(), lease.scope, lease.ttl_s, take_over=lease.take_over
    )
    return json_response(taken, 201, {"Location": f"/leases/{taken.lease}"})


@router.get("/leases/{lease_id}", Right.VIEW, any_scope=True, response_model=Lease)
async def get_lease(request: Request, lease_id: LeaseId) -> Response:
    """Tell who has a lease, and for how long."""
    return json_response(leases.get(plant_of(request), lease_id))


@router.post("/leases/{lease_id}/renew", Right.OPERATE, any_scope=True, response_model=Taken)
async def renew_lease(request: Request, lease_id: LeaseId) -> Response:
    """Let a lease last for its whole time from now on; its token stands in the header Lease-Token."""
    return json_response(await leases.renew(plant_of(request), origin(), lease_id))


@router.delete("/leases/{lease_id}", Right.OPERATE, any_scope=True, response_model=Lease)
async def end_lease(request: Request, lease_id: LeaseId) -> Response:
    """Give a lease back; an admin ends that of anybody."""
    return json_response(await leases.end(plant_of(request), origin(), lease_id))
