"""Metrics and status of a bridge, as monitoring reads them."""

import asyncio
import re
from typing import Any

import httpx
import pytest

from bridges.common.listener import CannotListen, listening
from bridges.common.state import Figures
from tests.bridges.loops import in_a_loop


async def read(address: str, *requests: tuple[str, str]) -> list[httpx.Response]:
    async with httpx.AsyncClient(base_url=address) as client:
        return [await client.request(method, path) for method, path in requests]


@pytest.mark.parametrize(("state", "status"), [("online", 200), ("offline", 503)])
@in_a_loop
async def test_metrics_and_status_are_told_and_nothing_else(
    state: str, status: int, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    figures = Figures()
    figures.command("replayed")
    told: dict[str, Any] = {"state": state, "reason": None}
    async with listening("127.0.0.1:0", figures, lambda: told):
        address = re.search(r"metrics at (\S+)/metrics", caplog.text)
        assert address
        requests = [("GET", "/metrics"), ("GET", "/status"), ("GET", "/"), ("POST", "/metrics")]
        metrics, json, *others = await read(address[1], *requests)
    assert 'motion_gateway_bridge_commands_total{outcome="replayed"} 1.0' in metrics.text
    assert 'motion_gateway_bridge_commands_total{outcome="refused"} 0.0' in metrics.text
    assert (json.status_code, json.json()) == (status, told)
    assert [it.status_code for it in others] == [404, 405]


@in_a_loop
async def test_an_address_that_is_taken_is_told() -> None:
    taken = await asyncio.start_server(lambda _reader, _writer: None, "127.0.0.1", 0)
    port = taken.sockets[0].getsockname()[1]
    with pytest.raises(CannotListen, match=f"127.0.0.1:{port} cannot be listened at"):
        async with listening(f"127.0.0.1:{port}", Figures(), dict):
            pass
    taken.close()


@in_a_loop
async def test_none_is_opened_where_none_is_asked_for() -> None:
    async with listening(None, Figures(), dict):
        pass
