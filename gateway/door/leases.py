"""Leases: who moves and sets a part of the plant, for seconds at a time."""

from typing import Annotated, Final

from pydantic import Field

from gateway.access.territory import PlantAccess
from gateway.core.errors import NotFound
from gateway.core.leases import LONGEST_S, Lease, Taken
from gateway.core.operation import Rows
from gateway.core.records import AnswerModel, RequestModel, example
from gateway.core.rights import Right
from gateway.core.targets import Opened
from gateway.door.caller import claim, holder, require, sees
from protocols.wording import as_given, joined

ROWS: Final = Rows("leases")
LeaseId = Annotated[str, Field(description="The id of a lease.", examples=["lease-1"])]


class LeaseRequest(RequestModel, json_schema_extra=example(scope="line1.3F", ttl_s=10.0)):
    """The part to lease, and for how long."""

    scope: str = Field(
        pattern="^[A-Za-z0-9.-]{1,64}$", description="The address of a line, a body, a group or a robot."
    )
    ttl_s: float = Field(
        10.0,
        ge=0.5,
        le=LONGEST_S,
        description="Seconds after which the lease ends, unless it is renewed before.",
    )
    take_over: bool = Field(
        default=False, description="End the leases of others that are in the way; takes the right `admin`."
    )


class LeaseList(AnswerModel):
    """All present leases."""

    leases: list[Lease]


@ROWS.get("/leases", any_scope=True)
async def list_leases(access: PlantAccess) -> LeaseList:
    """List leases with their holders; a key with a scope sees those within it."""
    return LeaseList(leases=[lease for lease in access.leases.all() if sees(access, lease.scope)])


@ROWS.post("/leases", Right.OPERATE, any_scope=True, leased=False, result=Taken, opens=True)
async def take_lease(access: PlantAccess, lease: LeaseRequest) -> Opened:
    """Lease a line, a body, a group or a robot: until it ends, no other caller moves or sets what is in it.

    Its holder sends its `token` as the header `Lease-Token` with each motion and each setting; several tokens
    stand side by side with commas. A token that is not good any more is refused even if there is no other
    lease. Reads and stops need none. When the lease ends, moves go on to their ends, and motion that would
    never end (a JOG, a move without an end) is stopped.
    """
    right = Right.ADMIN if lease.take_over else Right.OPERATE
    require(access, right, lease.scope, leased=False)
    path = _path(access, lease.scope)
    address = path.rpartition("/")[2]
    parts = access.territory.parts(address)
    taken = await access.leases.take(address, path, parts, holder(), lease.ttl_s, over=lease.take_over)
    return Opened(f"/leases/{taken.lease}", taken)


@ROWS.get("/leases/{lease_id}", any_scope=True)
async def get_lease(access: PlantAccess, lease_id: LeaseId) -> Lease:
    """Get a lease: its holder, and the time for which it lasts."""
    lease = access.leases.get(lease_id)
    require(access, Right.VIEW, lease.scope)
    return lease


@ROWS.post("/leases/{lease_id}/renew", Right.OPERATE, any_scope=True, leased=False)
async def renew_lease(access: PlantAccess, lease_id: LeaseId) -> Taken:
    """Renew a lease for its whole time from now on; the header Lease-Token shows its token."""
    require(access, Right.OPERATE, access.leases.get(lease_id).scope, leased=False)
    return access.leases.renew(lease_id, claim())


@ROWS.delete("/leases/{lease_id}", Right.OPERATE, any_scope=True, leased=False)
async def end_lease(access: PlantAccess, lease_id: LeaseId) -> Lease:
    """Give a lease back; an admin may end any caller's."""
    own = access.leases.is_of(lease_id, holder())
    right = Right.OPERATE if own else Right.ADMIN
    require(access, right, access.leases.get(lease_id).scope, leased=False)
    return access.leases.end(lease_id, holder())


def _path(access: PlantAccess, scope: str) -> str:
    """Where among the resources what an address names stands."""
    if scope in access.territory.lines:
        return f"/lines/{scope}"
    try:
        return access.territory.named(scope).path
    except NotFound:
        raise NotFound(
            f"There is no line, body, group or robot {as_given(scope)}; nothing was leased.",
            f"GET {joined('/lines', *access.territory.collections)} list what there is.",
        ) from None
