"""Somebody who asks for something, and in whose name the running code acts."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Final

from gateway.access.errors import NotAuthenticated
from gateway.access.roles import Role


@dataclass(frozen=True)
class Principal:
    """Somebody with a role, and where it holds."""

    name: str
    role: Role
    scope: frozenset[str] | None = None
    """Addresses of lines, bodies, groups and robots; None means everything."""
    id: str = ""
    """What limits are counted by: a key's prefix, or the subject of an issuer."""


EVERYBODY: Final = Principal("everybody", Role.ADMIN)
"""All who ask a gateway without access control."""

_current: ContextVar[Principal | None] = ContextVar("principal", default=None)


def current() -> Principal:
    """Tell who asked for what the running code does; tasks inherit it from those that begin them.

    :raises NotAuthenticated: nobody did.
    """
    principal = _current.get()
    if principal is None:
        raise NotAuthenticated("Nobody is named who asks for this; nothing was sent.")
    return principal


@contextmanager
def asking(principal: Principal) -> Iterator[None]:
    """Act because somebody asked."""
    token = _current.set(principal)
    try:
        yield
    finally:
        _current.reset(token)
