"""The stop of a plant: two ways, each on its own, and what is told where one or both fail."""

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from typing import Any

import httpx
import pytest

from fleet.errors import GatewayUnreached
from fleet.registry import Gateway, Registry
from fleet.stop import ANSWER_S, GOES_ON_S, PlantStop
from fleet.stop_message import StopMessage
from fleet.upstream import Caller
from tests.plants import in_virtual_time

CALLER = Caller("Bearer mg_abcd_secret", request_id="job17")
DONE = {"confirmed": True, "bodies": [{"body_id": "line1.3F", "state": "confirmed"}], "robots": []}


class Http:
    """Gateways by HTTP: each answers, or fails, as a test says."""

    def __init__(self, answers: Mapping[str, Any]) -> None:
        self.answers = dict(answers)
        self.asked: list[str] = []

    async def ask(self, gateway: Gateway, *_: object, **__: object) -> httpx.Response:
        self.asked.append(gateway.name)
        answer = self.answers.get(gateway.name, GatewayUnreached("It is not reached; nothing was sent."))
        if isinstance(answer, float):
            await asyncio.sleep(answer)
            answer = DONE
        if isinstance(answer, Exception):
            raise answer
        if isinstance(answer, int):
            return httpx.Response(answer, json={"detail": "The key is not good."})
        return httpx.Response(200, json=answer)


class Servers:
    """The servers of the plant: what gateways report by them."""

    def __init__(self, *reports: Mapping[str, Any], fault: Exception | None = None) -> None:
        self._reports, self._fault = reports, fault
        self.sent: list[StopMessage] = []

    @asynccontextmanager
    async def stopping(
        self, stop: StopMessage, on_report: Callable[[Mapping[str, Any]], None]
    ) -> AsyncIterator[None]:
        if self._fault is not None:
            raise self._fault
        self.sent.append(stop)
        for report in self._reports:
            on_report(report)
        yield


def stop_of(http: Http, servers: Servers, *names: str) -> PlantStop:
    registry: Any = Registry({name: f"https://{name}:8420" for name in names})
    upstream: Any = http
    follower: Any = servers
    return PlantStop(registry, upstream, follower)


async def states(stop: PlantStop) -> dict[str, str]:
    told = {it.gateway: it.state for it in await stop.stop(CALLER, "decelerate")}
    return {name: str(state) for name, state in told.items()}


@pytest.mark.parametrize(
    ("answers", "reports", "state"),
    [
        ({"s1": DONE}, (), "confirmed"),
        ({}, ({"gateway": "s1", "report": DONE},), "confirmed"),
        ({"s1": {**DONE, "confirmed": False}}, (), "unconfirmed"),
        ({}, ({"gateway": "s1", "received": True},), "unconfirmed"),
        ({}, (), "unreached"),
        ({"s1": 401}, (), "unreached"),
        ({"s1": DONE}, ({"gateway": "s1", "refused": "no key"},), "confirmed"),
        ({"s1": RuntimeError("a fault")}, ({"gateway": "s1", "report": DONE},), "confirmed"),
    ],
)
def test_the_first_way_that_arrives_counts(answers: Any, reports: Any, state: str) -> None:
    @in_virtual_time
    async def story() -> None:
        stop = stop_of(Http(answers), Servers(*reports), "s1")
        assert await states(stop) == {"s1": state}
        await stop.aclose()

    story()


def test_a_fault_at_the_servers_ends_no_attempt_by_http() -> None:
    @in_virtual_time
    async def story() -> None:
        stop = stop_of(Http({"s1": DONE, "s2": DONE}), Servers(fault=ConnectionError("gone")), "s1", "s2")
        begin = asyncio.get_running_loop().time()
        assert await states(stop) == {"s1": "confirmed", "s2": "confirmed"}
        assert asyncio.get_running_loop().time() - begin < 0.1
        await stop.aclose()

    story()


def test_a_slow_gateway_holds_nobody_up_for_longer_than_two_seconds() -> None:
    @in_virtual_time
    async def story() -> None:
        http = Http({"s1": DONE, "s2": 30.0})
        stop = stop_of(http, Servers(), "s1", "s2")
        begin = asyncio.get_running_loop().time()
        assert await states(stop) == {"s1": "confirmed", "s2": "unreached"}
        assert asyncio.get_running_loop().time() - begin == pytest.approx(ANSWER_S, abs=0.01)
        await stop.aclose()

    story()


def test_the_attempt_goes_on_for_a_minute_and_ends_when_the_gateway_is_back() -> None:
    @in_virtual_time
    async def story() -> None:
        http, servers = Http({}), Servers()
        stop = stop_of(http, servers, "s1")
        (attempt,) = await stop.stop(CALLER, "immediate")
        assert "hardware stop" in attempt.detail
        await asyncio.sleep(20)
        http.answers["s1"] = DONE
        await asyncio.sleep(1)
        assert attempt.state == "confirmed"
        tried = len(http.asked)
        await asyncio.sleep(GOES_ON_S)
        assert len(http.asked) == tried
        assert {it.mode for it in servers.sent} == {"immediate"}
        await stop.aclose()

    story()


def test_by_the_servers_the_hash_of_a_key_goes_and_never_the_key() -> None:
    @in_virtual_time
    async def story() -> None:
        servers = Servers()
        stop = stop_of(Http({"s1": DONE}), servers, "s1")
        await stop.stop(CALLER, "decelerate")
        await asyncio.sleep(0)
        (message,) = servers.sent
        assert (message.key_prefix, len(message.key_sha256), message.request_id) == ("abcd", 64, "job17")
        assert "secret" not in message.model_dump_json()
        await stop.aclose()

    story()


def test_whoever_has_the_lines_of_others_has_to_stop_them_though_never_heard() -> None:
    @in_virtual_time
    async def story() -> None:
        stop = stop_of(Http({"spare1": DONE}), Servers(), "spare1")
        registry: Any = stop._registry
        registry.get("spare1").owners = {"line1": "stocker1"}
        assert await states(stop) == {"spare1": "confirmed", "stocker1": "unreached"}
        await stop.aclose()

    story()


def test_a_report_counts_for_nothing_where_two_gateways_have_the_name() -> None:
    @in_virtual_time
    async def story() -> None:
        http = Http({"s1": DONE, "s2": DONE})
        stop = stop_of(http, Servers({"gateway": "s1", "report": DONE}), "s1", "s2")
        registry: Any = stop._registry
        registry.conflict_of = {"s1": "Two gateways are s1."}.get
        told = {it.gateway: it for it in await stop.stop(CALLER, "decelerate")}
        assert (told["s1"].state, told["s2"].state) == ("unconfirmed", "confirmed")
        assert "Nobody knows which of them has stopped" in told["s1"].detail
        await asyncio.sleep(GOES_ON_S)
        assert http.asked.count("s1") > 10, "the one that has the address now is stopped each time"
        assert http.asked.count("s2") == 1
        await stop.aclose()

    story()
