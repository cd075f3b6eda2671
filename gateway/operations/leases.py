"""Leases of parts of a plant: who moves and sets them, for seconds at a time."""

from gateway.access import principal
from gateway.core.errors import NotFound
from gateway.core.leases import Lease, Taken
from gateway.core.rights import Right
from gateway.operations.caller import claim, for_caller, holder, require
from gateway.plant import Plant
from protocols.wording import as_given


@for_caller
async def take(plant: Plant, scope: str, ttl_s: float, *, take_over: bool) -> Taken:
    """Lease a line, a body, a group or a robot; only an admin can take over what somebody else has leased.

    :raises NotFound: there is no such thing.
    :raises GatewayError: as of `Leases.take`.
    """
    require(plant, Right.ADMIN if take_over else Right.OPERATE, scope, leased=False)
    path = _path(plant, scope)
    address = path.rpartition("/")[2]
    parts = plant.territory.parts(address)
    return await plant.leases.take(address, path, parts, holder(), ttl_s, over=take_over)


@for_caller
async def renew(plant: Plant, lease_id: str) -> Taken:
    """Let a lease last on; errors as of `Leases.renew`."""
    require(plant, Right.OPERATE, plant.leases.get(lease_id).scope, leased=False)
    return plant.leases.renew(lease_id, claim())


@for_caller
async def end(plant: Plant, lease_id: str) -> Lease:
    """Give a lease back; that of somebody else is ended by an admin only.

    :raises NotFound: it is over.
    """
    own = plant.leases.is_of(lease_id, holder())
    right = Right.OPERATE if own else Right.ADMIN
    require(plant, right, plant.leases.get(lease_id).scope, leased=False)
    return plant.leases.end(lease_id, holder())


def seen(plant: Plant) -> list[Lease]:
    """The leases of what the caller may see."""
    who = principal.current()
    return [lease for lease in plant.leases.all() if plant.territory.covers(who, lease.scope)]


def get(plant: Plant, lease_id: str) -> Lease:
    """Give a lease.

    :raises NotFound: it is over.
    """
    lease = plant.leases.get(lease_id)
    require(plant, Right.VIEW, lease.scope)
    return lease


def _path(plant: Plant, scope: str) -> str:
    """Where among the resources what an address names stands."""
    if scope in plant.ports():
        return f"/lines/{scope}"
    try:
        return plant.named(scope).path
    except NotFound:
        raise NotFound(
            f"There is no line, body, group or robot {as_given(scope)}; nothing was leased.",
            "GET /lines, /bodies, /groups, /scaras and /robots list what there is.",
        ) from None
