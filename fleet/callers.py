"""Rights of callers: each gateway judges the caller's own key, the plant process decides nothing."""

import asyncio
from collections.abc import Mapping
from dataclasses import dataclass
from time import monotonic
from typing import Any, Final

from fleet.feed import PlantEvent, Wanted
from fleet.registry import Gateway, Registry
from fleet.upstream import Caller, Upstream
from gateway.access.errors import NotAuthenticated, NotPermitted
from gateway.core.errors import GatewayError

FRESH_S: Final = 5.0
"""Seconds for which a gateway's verdict on a key counts."""
KEPT_S: Final = 3600.0
"""Seconds for which the last verdict of a gateway that cannot be asked counts."""
MOST: Final = 10_000


@dataclass(frozen=True)
class Verdict:
    """A gateway's verdict on a caller."""

    sees: bool
    scope: frozenset[str] | None
    at: float


class Callers:
    """Asks the gateways who may see something; nothing is asked where the plant is open."""

    def __init__(self, registry: Registry, upstream: Upstream, *, is_open: bool) -> None:
        self._registry, self._upstream = registry, upstream
        self._is_open = is_open
        self._verdicts: dict[tuple[str, str], Verdict] = {}

    def require_shown(self, caller: Caller) -> None:
        """Refuse who shows nothing.

        :raises NotAuthenticated: the plant takes keys, and none is shown.
        """
        if not self._is_open and not caller.authorization:
            raise NotAuthenticated("A key is needed; nothing was sent.")

    async def sight_of(self, caller: Caller) -> "Sight":
        """Find out what a caller may see.

        :raises NotAuthenticated, NotPermitted: no gateway takes the key, or none can be asked about it.
        """
        if self._is_open:
            return Sight(None)
        self.require_shown(caller)
        gateways = self._registry.all()
        verdicts = await asyncio.gather(*(self._verdict(caller, gateway) for gateway in gateways))
        told = {gateway.name: verdict for gateway, verdict in zip(gateways, verdicts, strict=True)}
        if any(verdict is not None and verdict.sees for verdict in verdicts):
            return Sight(told)
        if any(verdict is not None for verdict in verdicts):
            raise NotAuthenticated("No gateway of the plant takes this key; nothing was sent.")
        raise NotPermitted(
            "No gateway of the plant can be asked whether this key is good; nothing was sent.",
            "Use the console of a gateway itself; POST /stop goes to all of them nevertheless.",
        )

    async def _verdict(self, caller: Caller, gateway: Gateway) -> Verdict | None:
        key = caller.id, gateway.name
        known = self._verdicts.get(key)
        if known is not None and monotonic() - known.at < FRESH_S:
            return known
        try:
            answer = await self._upstream.ask(
                gateway, "GET", "/system/identity", caller.headers, within_s=FRESH_S / 2
            )
        except GatewayError:
            return known if known is not None and monotonic() - known.at < KEPT_S else None
        told: Mapping[str, Any] = answer.json() if answer.is_success else {}
        scope = told.get("scope")
        verdict = Verdict(
            "view" in told.get("rights", ()), None if scope is None else frozenset(scope), monotonic()
        )
        while len(self._verdicts) >= MOST:
            del self._verdicts[next(iter(self._verdicts))]
        self._verdicts.pop(key, None)
        self._verdicts[key] = verdict
        return verdict


class Sight:
    """The events that a caller may see."""

    def __init__(self, verdicts: Mapping[str, Verdict | None] | None) -> None:
        self._verdicts = verdicts
        known = [verdict for verdict in (verdicts or {}).values() if verdict is not None]
        self._sees_unasked = all(verdict.sees and verdict.scope is None for verdict in known)
        """True if a gateway that cannot be asked is visible: every other gateway lets this caller see
        everything."""

    def sees(self, event: PlantEvent) -> bool:
        """Tell if the caller may see an event."""
        if self._verdicts is None:
            return True
        verdict = self._verdicts.get(event.gateway)
        if verdict is None:
            return self._sees_unasked
        return verdict.sees and (verdict.scope is None or _covers(verdict.scope, event.subject))

    def within(self, wanted: Wanted) -> Wanted:
        """Narrow what is wanted down to it."""
        return lambda event: self.sees(event) and wanted(event)


def _covers(scope: frozenset[str], subject: str) -> bool:
    """Tell if a scope covers the subject of an event: a line covers all that is on it, a robot its units."""
    _, _, address = subject.rpartition(":")
    names = {address, address.partition(".")[0], address.partition("/")[0]}
    return ":" in subject and not scope.isdisjoint(names)
