"""The caller of an operation and the rights of that caller: every front end asks here."""

from collections.abc import Callable, Coroutine
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar

from gateway.access import principal
from gateway.access.errors import NotPermitted
from gateway.access.territory import PlantAccess
from gateway.core.leases import Holder
from gateway.core.operation import LEASED
from gateway.core.origin import ORIGIN, Claim, Origin, acting, current, new_request_id
from gateway.core.rights import Right
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
    "new_request_id",
    "require",
    "sees",
]

P = ParamSpec("P")
R = TypeVar("R")

T = TypeVar("T")


def for_caller(
    operation: Callable[Concatenate[T, P], Coroutine[Any, Any, R]],
) -> Callable[Concatenate[T, Origin, P], Coroutine[Any, Any, R]]:
    """Let an operation take its caller behind the plant, and act for it; it asks for rights on its own."""

    @wraps(operation)
    async def carried_out(plant: T, caller: Origin, /, *args: P.args, **kwargs: P.kwargs) -> R:
        before = ORIGIN.set(caller)
        try:
            return await operation(plant, *args, **kwargs)
        finally:
            ORIGIN.reset(before)

    return carried_out


def require(access: PlantAccess, right: Right, *targets: object, leased: bool = True) -> None:
    """Refuse a caller who lacks the right on any of these, or the lease that moving and setting takes.

    :raises NotPermitted: the role or the scope does not allow it; nothing was sent.
    :raises LeaseRefused: another caller has a lease there, or the caller's is over; nothing was sent.
    """
    who = principal.current()
    if right is Right.STOP:  # any valid credential will do: nothing is looked at in which a fault could be
        return
    addresses = [address_of(str(target)) for target in targets]
    try:
        access.territory.require(who, right, *addresses)
    except NotPermitted as refusal:
        access.security.note(entries.REQUEST_REFUSED, " ".join(addresses), why=refusal.detail)
        raise
    if leased and right in LEASED:
        for line_id in {part.line_id for address in addresses for part in access.territory.parts(address)}:
            access.ownership.require_owner(line_id, ORIGIN.get().claim.owner_epoch)
    if leased and right in LEASED and access.leases.mode != "off":
        origin = ORIGIN.get()
        parts = tuple(part for address in addresses for part in access.territory.parts(address))
        ORIGIN.set(origin.claiming(access.leases.admit(Claim(origin.claim.tokens, parts, who.id))))


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


def sees(access: PlantAccess, address: str) -> bool:
    """Say whether the caller may see this address in a list: keys with a scope see what it covers."""
    return access.territory.covers(principal.current(), address)
