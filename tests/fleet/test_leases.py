"""Leases over several gateways: all or none, and what one gateway does keeps none of the others."""

import asyncio
import json
from collections.abc import Mapping
from typing import Any

import httpx
import pytest

from fleet.errors import AnswerLost, GatewayUnreached
from fleet.leases import PlantLeaseRequest, PlantLeases, Refusal
from fleet.registry import Gateway, Registry
from fleet.upstream import Caller
from gateway.core.errors import NotFound

CALLER = Caller("Bearer mg_abcd_secret")
BOTH = "s1:l-s1,s2:l-s2"


class Gateways:
    """Two gateways that lease everything, unless a test says otherwise."""

    def __init__(self, faults: Mapping[str, Exception | int] | None = None) -> None:
        self.faults = faults or {}
        self.asked: list[tuple[str, str]] = []

    async def ask(
        self,
        gateway: Gateway,
        method: str,
        path: str,
        headers: Any,
        content: bytes = b"",
        within_s: float = 90.0,
    ) -> httpx.Response:
        assert within_s < 5, "a lease ends while one waits longer"
        self.asked.append((gateway.name, f"{method} {path} {headers.get('Lease-Token', '')}".strip()))
        fault = self.faults.get(gateway.name)
        if isinstance(fault, Exception):
            raise fault
        if fault is not None:
            return httpx.Response(fault, json={"detail": "Somebody else has it."})
        scope = json.loads(content)["scope"] if content else "line1"
        return httpx.Response(200, json={"lease": f"l-{gateway.name}", "scope": scope, "token": 7})


def leases_of(gateways: Gateways) -> PlantLeases:
    registry = Registry({"s1": "https://s1.example", "s2": "https://s2.example"})
    return PlantLeases(registry, gateways)  # type: ignore[arg-type]


def test_they_are_taken_in_one_order_whatever_the_order_of_the_request() -> None:
    gateways = Gateways()
    asked = PlantLeaseRequest(scopes=["s2:line1", "s1:line1", "s2:line1"])
    taken = asyncio.run(leases_of(gateways).take(asked, CALLER))
    assert [gateway for gateway, _ in gateways.asked] == ["s1", "s2"]
    assert (taken["lease"], taken["token"]) == (BOTH, "s1:7,s2:7")


@pytest.mark.parametrize("fault", [423, GatewayUnreached("?"), AnswerLost("?")])
def test_where_one_gateway_does_not_lease_nothing_is_leased(fault: Any) -> None:
    gateways = Gateways({"s2": fault})
    asked = PlantLeaseRequest(scopes=["s1:line1", "s2:line1"])
    with pytest.raises(Refusal if isinstance(fault, int) else type(fault)):
        asyncio.run(leases_of(gateways).take(asked, CALLER))
    assert gateways.asked[-1] == ("s1", "DELETE /leases/l-s1")


@pytest.mark.parametrize(
    ("action", "request_"), [("DELETE", "DELETE /leases/l-s2 7"), ("renew", "POST /leases/l-s2/renew 7")]
)
@pytest.mark.parametrize("fault", [404, GatewayUnreached("?"), AnswerLost("?")])
def test_a_gateway_that_is_lost_keeps_no_lease_of_another_from_being_renewed_or_given_back(
    action: str, request_: str, fault: Any
) -> None:
    gateways = Gateways({"s1": fault})
    with pytest.raises(Refusal if isinstance(fault, int) else type(fault)):
        asyncio.run(leases_of(gateways).each(BOTH, action, "s1:7,s2:7", CALLER))
    assert ("s2", request_) in gateways.asked


@pytest.mark.parametrize("scope", ["line1", "s9:line1", "s1:", ":line1", "", "s1:line1,s9:line1"])
def test_nothing_is_asked_for_what_is_not_in_the_plant(scope: str) -> None:
    gateways = Gateways()
    with pytest.raises(NotFound):
        asyncio.run(leases_of(gateways).each(scope, "DELETE", "", CALLER))
    assert gateways.asked == []


def test_an_id_is_one_part_of_a_path() -> None:
    gateways = Gateways()
    asyncio.run(leases_of(gateways).each("s1:../stop?x", "", "", CALLER))
    assert gateways.asked == [("s1", "GET /leases/..%2Fstop%3Fx")]
