"""The caller of an operation and the rights of that caller: every front end asks here."""

from collections.abc import Callable, Coroutine
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar

from gateway.access import principal
from gateway.access.errors import NotPermitted
from gateway.core.leases import Holder
from gateway.core.operation import LEASED
from gateway.core.origin import ORIGIN, Claim, Origin, acting, current, new_request_id
from gateway.core.rights import Right
from gateway.plant import Plant
from gateway.security import entries

__all__ = [
    "ORIGIN",
    "Claim",
    "Origin",
    "acting",
    "address_of",
    "claim",
    "current",
    "for_caller",
    "holder",
    "needs",
    "new_request_id",
    "require",
    "sees",
]

P = ParamSpec("P")
R = TypeVar("R")

Operation = Callable[Concatenate[Plant, P], Coroutine[Any, Any, R]]
OfCaller = Callable[Concatenate[Plant, Origin, P], Coroutine[Any, Any, R]]


def for_caller(operation: Operation[P, R]) -> OfCaller[P, R]:
    """Let an operation take its caller behind the plant, and act for it; it asks for rights on its own."""

    @wraps(operation)
    async def carried_out(plant: Plant, caller: Origin, /, *args: P.args, **kwargs: P.kwargs) -> R:
        before = ORIGIN.set(caller)
        try:
            return await operation(plant, *args, **kwargs)
        finally:
            ORIGIN.reset(before)

    return carried_out


def needs(
    right: Right, *, whole_plant: bool = False, leased: bool = True
) -> Callable[[Operation[P, R]], OfCaller[P, R]]:
    """Let an operation act for its caller, who needs a right on its first argument: an id, or a path.

    One that only asks is not `leased`, whatever its right.
    """

    def guarded(operation: Operation[P, R]) -> OfCaller[P, R]:
        @wraps(operation)
        async def allowed(plant: Plant, /, *args: P.args, **kwargs: P.kwargs) -> R:
            require(plant, right, *() if whole_plant else args[:1], leased=leased)
            return await operation(plant, *args, **kwargs)

        return for_caller(allowed)

    return guarded


def require(plant: Plant, right: Right, *targets: object, leased: bool = True) -> None:
    """Refuse a caller who lacks the right on any of these, or the lease that moving and setting takes.

    :raises NotPermitted: the role or the scope does not allow it; nothing was sent.
    :raises LeaseRefused: another caller has a lease there, or the caller's is over; nothing was sent.
    """
    who = principal.current()
    if right is Right.STOP:  # any valid credential will do: nothing is looked at in which a fault could be
        return
    addresses = [address_of(str(target)) for target in targets]
    try:
        plant.access.territory.require(who, right, *addresses)
    except NotPermitted as refusal:
        plant.access.security.note(entries.REQUEST_REFUSED, " ".join(addresses), why=refusal.detail)
        raise
    if leased and right in LEASED:
        for line_id in {
            part.line_id for address in addresses for part in plant.access.territory.parts(address)
        }:
            plant.peers.ownership.require_owner(line_id, ORIGIN.get().claim.owner_epoch)
    if leased and right in LEASED and plant.access.leases.mode != "off":
        origin = ORIGIN.get()
        parts = tuple(part for address in addresses for part in plant.access.territory.parts(address))
        ORIGIN.set(origin.claiming(plant.access.leases.admit(Claim(origin.claim.tokens, parts, who.id))))


def claim() -> Claim:
    """The leases that the caller shows."""
    return Claim(ORIGIN.get().claim.tokens, (), principal.current().id)


def holder() -> Holder:
    """The caller, as one who can have leases."""
    who = principal.current()
    return Holder(who.name, who.id)


def address_of(target: str) -> str:
    """The address in a path such as `/robots/r1/units/1`, or an id as it stands."""
    return target.split("/", 3)[2] if target.count("/") > 1 else target


def sees(plant: Plant, address: str) -> bool:
    """Say whether the caller may see this address in a list: keys with a scope see what it covers."""
    return plant.access.territory.covers(principal.current(), address)
