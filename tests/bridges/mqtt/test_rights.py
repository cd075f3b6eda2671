"""Whatever is commanded over MQTT has the verdict that HTTP gives: every operation, role and scope."""

import asyncio
import json
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

import httpx
import pytest
from aiomqtt import Message
from fastapi import FastAPI
from motion_gateway_client import AsyncGateway

from api.app import create_app
from bridges.common.callers import Caller, Callers, Doors
from bridges.common.settings import GatewayTable
from bridges.common.state import Figures
from bridges.mqtt.commands import SECRETS, Commands
from bridges.mqtt.operations import Operations
from gateway.access.roles import Role
from tests.api.access.guarded import Keys
from tests.api.access.test_matrix import IN, OUT, Probing, Row, asked, routes_of, row_of
from tests.api.stand import HOST
from tests.api.whole_plant import whole_plant

ROOT: Final = "motion/test"
DOCUMENT: Final = Path(__file__).parents[3] / "openapi" / "openapi.json"
Scope = tuple[str, ...] | None


class DoorsInside(Doors):
    """Open to an application without a network."""

    def __init__(self, app: FastAPI) -> None:
        super().__init__(GatewayTable(url=f"http://{HOST}"))
        self._app = app

    def open(self, key: str | None, language: str | None = None) -> AsyncGateway:
        transport = httpx.ASGITransport(self._app)
        headers = {"Accept-Language": language} if language else None
        http = httpx.AsyncClient(transport=transport, base_url=f"http://{HOST}", headers=headers)
        return AsyncGateway(key=key, http=http)


class Everybody(Callers):
    """A caller for each role and scope, named by both."""

    def __init__(self, app: FastAPI, keys: Keys) -> None:
        self._app, self._keys = app, keys
        self._made: dict[str, Caller] = {}

    def get(self, name: str) -> Caller | None:
        role, _, scope = name.partition(",")
        if name not in self._made:
            named = [it.replace("%2F", "/") for it in scope.split(",")] if scope else []
            key = self._keys.of(role, *named)
            self._made[name] = Caller(DoorsInside(self._app), lambda: key)
        return self._made[name]


def name_of(role: Role, scope: Scope) -> str:
    return ",".join((role.value, *(it.replace("/", "%2F") for it in scope or ())))


def command(who: str, path: str) -> Message:
    properties = SimpleNamespace(CorrelationData=b"c", ResponseTopic="answer", MessageExpiryInterval=9)
    return Message(f"{ROOT}/cmd/{who}{path}", b"{}", 1, False, 1, properties)  # type: ignore[arg-type]


def cells(app: FastAPI) -> Iterator[tuple[Row, Role, Scope]]:
    for method, path in routes_of(app):
        if method == "POST" and not path.startswith(SECRETS):
            row = row_of(method, path)
            most = 1 if "/commands/" in path else None
            scopes = (None, *IN[row.about][:most], *OUT[row.about][:most])
            yield from ((row, role, scope) for role, scope in product(Role, scopes))


async def verdict(commands: Commands, say: Callable[[], Message]) -> int:
    """Command, and give the status of the answer."""
    answer: asyncio.Future[Any] = asyncio.get_running_loop().create_future()

    async def hear(letter: Any) -> None:
        answer.set_result(json.loads(letter.payload))

    delivering = asyncio.create_task(commands.answers.deliver(hear))
    commands.take(say())
    status = int((await answer)["status"])
    delivering.cancel()
    await asyncio.gather(delivering, return_exceptions=True)
    return status


@pytest.mark.long
def test_the_verdict_is_that_of_http_for_every_operation_role_and_scope(tmp_path: Path) -> None:
    keys = Keys(tmp_path)
    plant = whole_plant()
    app = create_app(plant, keys.credentials)
    app.state.access = Probing(plant)
    operations = Operations(json.loads(DOCUMENT.read_text("utf-8")))
    differ: list[str] = []
    looked_at = 0

    async def run() -> None:
        nonlocal looked_at
        commands = Commands(ROOT, Everybody(app, keys), Figures(), operations.find)
        for row, role, scope in cells(app):
            looked_at += 1
            by_http = await asked(app, row, keys.header(role, *scope or ()))
            by_mqtt = await verdict(commands, lambda: command(name_of(role, scope), row.target))  # noqa: B023
            if by_http != by_mqtt:
                differ.append(f"{row}: {role} {scope}: {by_http} over HTTP, {by_mqtt} over MQTT")

    asyncio.run(run())
    assert differ == []
    assert looked_at > 3_000
    print(f"{looked_at} verdicts")
