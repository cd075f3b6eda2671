"""Callers: each has a key of its own, which is read again where it was rotated."""

from pathlib import Path
from typing import Any

import httpx
import pytest
from motion_gateway_client import Answer, NoAnswer
from motion_gateway_client.async_gateway import STOP_TRIES

from bridges.common.callers import Caller, Callers, Doors
from bridges.common.settings import CallerTable, GatewayTable
from tests.bridges.loops import in_a_loop

MES = "mes"


class Let:
    """A gateway that lets one key in."""

    def __init__(self, key: str) -> None:
        self.key = key
        self.asked: list[str] = []

    async def handle_async_request(self, request: httpx.Request) -> httpx.Response:
        given = request.headers["authorization"].removeprefix("Bearer ")
        self.asked.append(f"{given} {request.method} {request.url.path}")
        return httpx.Response(200 if given == self.key else 401, json={"detail": "?"})


@pytest.fixture
def callers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Callers, Let, Path]:
    file, let = tmp_path / "key", Let("new")
    file.write_text("old\n")
    made = httpx.AsyncClient

    def client(**options: Any) -> httpx.AsyncClient:
        return made(base_url=options["base_url"], transport=httpx.MockTransport(let.handle_async_request))

    monkeypatch.setattr(httpx, "AsyncClient", client)
    doors = Doors(GatewayTable(url="http://gateway"))
    return Callers(doors, {MES: CallerTable(key_file=file)}), let, file


@in_a_loop
async def test_a_key_that_was_rotated_is_read_again_and_the_request_sent_once_more(
    callers: tuple[Callers, Let, Path],
) -> None:
    them, let, file = callers
    mes = them.get(MES)
    assert mes
    assert (await mes.ask("POST", "/stop")).status == 401
    assert let.asked == ["old POST /stop"], "the file has the same key"
    file.write_text("new\n")
    assert (await mes.ask("POST", "/stop")).status == 200
    assert let.asked[1:] == ["old POST /stop", "new POST /stop"]
    file.unlink()
    assert (await mes.ask("POST", "/stop")).status == 200
    await them.aclose()


@in_a_loop
async def test_others_bring_their_keys(callers: tuple[Callers, Let, Path]) -> None:
    them, let, _ = callers
    assert them.get("eve") is None
    guest = them.bringing("new")
    assert (await guest.ask("GET", "/bodies")).is_success
    await guest.aclose()
    assert let.asked == ["new GET /bodies"]
    await them.aclose()


class Breaking(Caller):
    """A caller whose connection breaks `breaks` times."""

    def __init__(self, breaks: int) -> None:
        self.breaks, self.asked = breaks, 0

    async def ask(self, *_: Any, **__: Any) -> Answer:
        self.asked += 1
        if self.asked <= self.breaks:
            raise NoAnswer("The connection broke.")
        return Answer(200, {"confirmed": True}, False)


@in_a_loop
async def test_a_stop_is_sent_again_where_the_connection_breaks() -> None:
    assert (await Breaking(STOP_TRIES - 1).stop("/stop")).is_success
    lost = Breaking(STOP_TRIES)
    with pytest.raises(NoAnswer):
        await lost.stop("/stop")
    assert lost.asked == STOP_TRIES
