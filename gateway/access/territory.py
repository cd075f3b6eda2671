"""The scopes of a plant, the one check of rights that all front ends share, and what decides besides."""

from collections.abc import Collection, Container, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import ClassVar, Final, Protocol

from gateway.access.credentials import Credentials
from gateway.access.errors import NotPermitted
from gateway.access.grants import Sessions
from gateway.access.principal import Principal
from gateway.access.roles import RIGHTS_OF
from gateway.core.addresses import fits
from gateway.core.errors import Ambiguous, NotFound
from gateway.core.leases import Leases
from gateway.core.parts import Part
from gateway.core.rights import Right
from gateway.core.targets import Target
from gateway.ownership import Ownership
from gateway.security.log import SecurityLog
from protocols.wording import as_given

MOST_KNOWN: Final = 10_000
"""Addresses, in each spelling of upper and lower case, that are remembered with what they mean."""


class Placed(Protocol):
    """A package, as far as it finds what stands in its collections."""

    collections: ClassVar[Sequence[str]]
    """The resources that its targets are among."""

    def target(self, collection: str, names: Sequence[str], /) -> Target:
        """Find what commands are addressed to."""

    def parts(self, address: str, /) -> Sequence[Part]:
        """Find the parts that an address means now."""

    def parts_in_scope(self, name: str, /) -> Sequence[Part]:
        """Find the parts that a name in a scope covers."""


class Territory:
    """The addresses of a plant.

    A line covers all that is on it. A command to a group needs all that are members now. One in a scope
    covers the members that the configuration gives it.
    """

    def __init__(self, lines: Container[str], registered: Collection[Placed]) -> None:
        self.lines, self._registered = lines, registered
        """Lines by their ids, and what may stand on them."""
        self._covered: dict[frozenset[str], frozenset[str]] = {}
        self._single: dict[str, Sequence[Part]] = {}
        """Parts of addresses that mean one part; groups are looked up anew, since their members change."""

    def forget(self) -> None:
        """Read anew what addresses mean: other things are configured now."""
        self._covered.clear()
        self._single.clear()

    @property
    def collections(self) -> Sequence[str]:
        """The resources of what is on lines."""
        return [f"/{name}" for kind in self._registered for name in kind.collections]

    def require(self, principal: Principal, right: Right, *addresses: str) -> None:
        """Refuse a caller who lacks the right on any of these addresses; no address means the whole plant.

        A stop takes no scope, and every role may: with any valid credential everything can be stopped.

        :raises NotPermitted: the role or the scope does not allow it; nothing was sent.
        :raises Ambiguous: an address fits several lines.
        """
        if right is Right.STOP:
            return
        self.require_right(principal, right)
        if principal.scope is None or right is Right.OPEN:
            return
        if not addresses:
            meant = ", ".join(sorted(principal.scope)) or "nothing"
            raise NotPermitted.worded("key.whole-plant", name=principal.name, scope=meant)
        for address in addresses:
            if not self._covers(principal, address):
                raise NotPermitted.worded("key.out-of-scope", name=principal.name, address=address)

    def _covers(self, principal: Principal, address: str) -> bool:
        """Do as `covers`; where an address fits several lines, the caller is told no names of them."""
        try:
            return self.covers(principal, address)
        except Ambiguous as error:
            error.withhold_names()
            raise

    @staticmethod
    def require_right(principal: Principal, right: Right) -> None:
        """Refuse a caller whose role lacks the right altogether.

        :raises NotPermitted: it does not; nothing was sent.
        """
        if right not in RIGHTS_OF[principal.role]:
            raise NotPermitted.worded("key.no-right", right=right, role=principal.role, name=principal.name)

    def covers(self, principal: Principal, address: str) -> bool:
        """Say whether a caller's scope includes all that an address means; an unknown address is in none.

        :raises Ambiguous: it fits several lines.
        """
        if principal.scope is None:
            return True
        wanted = self.parts(address)
        if not wanted:
            return False
        covered = self._covered.get(principal.scope)
        if covered is None:
            covered = frozenset(part for name in principal.scope for part in self._meant_by(name))
            self._covered[principal.scope] = covered
        for part in wanted:  # noqa: SIM110  # at each request: `all` would make a generator
            if part.address not in covered and part.line_id not in covered:
                return False
        return True

    def named(self, address: str) -> Target:
        """Find what an address names, in whatever collection it stands.

        :raises NotFound: there is no such thing.
        :raises Ambiguous: it fits several lines.
        """
        for kind in self._registered:
            for collection in kind.collections:
                with suppress(NotFound):
                    return kind.target(collection, address.split("/"))
        raise NotFound(f"There is nothing of the address {as_given(address)}; nothing was sent.")

    def _meant_by(self, name: str) -> Iterable[str]:
        """The addresses that a name in a scope covers: none, if it fits nothing or several lines."""
        if name in self.lines:
            return [name]
        return [part.address for kind in self._registered for part in kind.parts_in_scope(name)]

    def parts(self, address: str) -> Sequence[Part]:
        """Find the parts that an address means: members of a group, or the line of one that is not there yet.

        :raises Ambiguous: it fits several lines.
        """
        known = self._single.get(address)
        if known is not None:
            return known
        if address in self.lines:
            return [Part(address, address)]
        parts = [part for kind in self._registered for part in kind.parts(address)]
        own = address.partition("/")[0]
        if len(parts) == 1 and fits(own, parts[0].address) and len(self._single) < MOST_KNOWN:
            self._single[address] = parts
        return parts


@dataclass(slots=True)
class PlantAccess:
    """All that decides who may do what, and where it is noted."""

    security: SecurityLog
    leases: Leases
    territory: Territory
    ownership: Ownership
    credentials: Credentials = field(default_factory=Credentials)
    """Credentials of callers; the server replaces them by its own."""
    sessions: Sessions = field(default_factory=Sessions)
    """Sessions of browsers that have signed in."""
