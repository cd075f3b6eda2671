"""Leases over several gateways: taken in one order, and given back together."""

import asyncio
import json
from collections.abc import Sequence
from contextlib import suppress
from typing import Annotated, Any, Final
from urllib.parse import quote

import httpx
from pydantic import BaseModel, ConfigDict, Field

from fleet.addresses import outward, tokens_for
from fleet.registry import Gateway, Registry
from fleet.upstream import WITHIN_S, Caller, Upstream
from gateway.core.errors import GatewayError, InvalidRequest, NotFound

JSON: Final = {"Content-Type": "application/json"}


class PlantLeaseRequest(BaseModel):
    """A request to lease one address of the plant, or several together."""

    model_config = ConfigDict(extra="forbid")

    scope: str | None = None
    scopes: Annotated[list[str], Field(max_length=32)] = []
    ttl_s: float = 10.0
    take_over: bool = False


class Refusal(Exception):
    """A gateway has refused a lease; those that were taken before are given back."""

    def __init__(self, gateway: str, answer: httpx.Response) -> None:
        super().__init__(f"{gateway}: status {answer.status_code}")
        self.gateway, self.answer = gateway, answer


class PlantLeases:
    """Takes, renews and ends leases at the gateways that own what is leased."""

    def __init__(self, registry: Registry, upstream: Upstream) -> None:
        self._registry, self._upstream = registry, upstream

    async def take(self, asked: PlantLeaseRequest, caller: Caller) -> dict[str, Any]:
        """Take all leases in the order of their addresses, so that two callers never wait in a ring.

        :raises Refusal: a gateway has refused; nothing is leased.
        :raises GatewayError: a gateway was not reached, or there is no such thing; nothing is leased.
        """
        scopes = sorted({*asked.scopes, *([asked.scope] if asked.scope else [])})
        if not scopes:
            raise InvalidRequest("scope: it is missing; nothing was leased.", "Name what to lease.")
        places = [self._place(scope) for scope in scopes]
        taken: list[tuple[Gateway, Any]] = []
        try:
            for gateway, scope in places:
                wanted = {"scope": scope, "ttl_s": asked.ttl_s, "take_over": asked.take_over}
                taken.append((gateway, await self._take_one(gateway, wanted, caller)))
        except BaseException:
            await self._give_back(taken, caller)
            raise
        return _united([outward(gateway.name, lease) for gateway, lease in taken])

    async def _take_one(self, gateway: Gateway, wanted: object, caller: Caller) -> Any:
        content = json.dumps(wanted).encode()
        headers = {**caller.headers, **JSON}
        answer = await self._upstream.ask(gateway, "POST", "/leases", headers, content, WITHIN_S)
        if not answer.is_success:
            raise Refusal(gateway.name, answer)
        return answer.json()

    async def _give_back(self, taken: Sequence[tuple[Gateway, Any]], caller: Caller) -> None:
        for gateway, lease in reversed(taken):
            with suppress(GatewayError, Refusal):  # it ends by itself
                await self._ask(gateway, lease["lease"], "DELETE", "", caller)

    async def each(self, leases: str, action: str, tokens: str, caller: Caller) -> dict[str, Any]:
        """Renew (`renew`), read (empty) or end (`DELETE`) leases that were taken together: ids with commas.

        :raises Refusal: a gateway has refused one; the others are renewed, or ended, nevertheless.
        :raises GatewayError: a gateway was not reached; the others are renewed, or ended, nevertheless.
        """
        asking = [
            self._ask(gateway, lease, action, tokens, caller)
            for gateway, lease in [self._place(lease) for lease in leases.split(",")]
        ]
        told = await asyncio.gather(*asking, return_exceptions=True)
        if faults := [answer for answer in told if isinstance(answer, BaseException)]:
            raise faults[0]
        return _united([answer for answer in told if not isinstance(answer, BaseException)])

    async def _ask(self, gateway: Gateway, lease: str, action: str, tokens: str, caller: Caller) -> Any:
        path = f"/leases/{quote(lease, safe='')}{'/renew' if action == 'renew' else ''}"
        method = "DELETE" if action == "DELETE" else "POST" if action else "GET"
        shown = tokens_for(gateway.name, tokens)
        headers = {**caller.headers, **({"Lease-Token": shown} if shown else {})}
        answer = await self._upstream.ask(gateway, method, path, headers, within_s=WITHIN_S)
        if not answer.is_success:
            raise Refusal(gateway.name, answer)
        return outward(gateway.name, answer.json())

    def _place(self, scope: str) -> tuple[Gateway, str]:
        name, colon, own = scope.strip().partition(":")
        gateway = self._registry.get(name)
        if not (colon and own) or gateway is None:
            raise NotFound(
                f"There is no {scope[:80]} in the plant; nothing was leased.",
                "Put the name of a gateway in front: stocker1:line1.3F. GET /gateways lists them.",
            )
        return gateway, own


def _united(leases: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """One lease as it is; of several one document, whose id and token stand for all of them."""
    if len(leases) == 1:
        return dict(leases[0])
    return {
        "lease": ",".join(lease["lease"] for lease in leases),
        **(
            {"token": ",".join(lease["token"] for lease in leases)}
            if all("token" in lease for lease in leases)
            else {}
        ),
        "leases": list(leases),
    }
