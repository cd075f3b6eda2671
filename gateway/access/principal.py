"""The caller in whose name the running code acts."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Final

from gateway.access.errors import NotAuthenticated
from gateway.access.roles import Role


@dataclass(frozen=True)
class Principal:
    """A caller with a role, and the addresses where it holds."""

    name: str
    role: Role
    scope: frozenset[str] | None = None
    """Addresses of lines, bodies, groups and robots; None means everything."""
    id: str = ""
    """Name under which limits count: a key's prefix, or the subject of an issuer."""


EVERYBODY: Final = Principal("everybody", Role.ADMIN)
"""All who ask a gateway without access control."""

PRINCIPAL: ContextVar[Principal | None] = ContextVar("principal", default=None)


def current() -> Principal:
    """Give the caller of the running code; tasks inherit it from the tasks that begin them.

    :raises NotAuthenticated: the code runs for no caller.
    """
    principal = PRINCIPAL.get()
    if principal is None:
        raise NotAuthenticated("Nobody is named who asks for this; nothing was sent.")
    return principal


@contextmanager
def asking(principal: Principal) -> Iterator[None]:
    """Run the block on behalf of a caller."""
    token = PRINCIPAL.set(principal)
    try:
        yield
    finally:
        PRINCIPAL.reset(token)
