"""Commands over MQTT get the verdict that HTTP gives: every operation, role and scope."""

import asyncio
import json
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

import pytest
from aiomqtt import Message

from api.app import Application, create_app
from bridges.common.callers import Caller, Callers
from bridges.common.state import Figures
from bridges.mqtt.commands import SECRETS, Commands
from bridges.mqtt.operations import Operations
from gateway.access.roles import Role
from tests.api.access.guarded import Keys
from tests.api.access.test_matrix import IN, OUT, Probing, Row, asked, routes_of, row_of
from tests.api.whole_plant import whole_plant
from tests.bridges.inside import DoorsInside

ROOT: Final = "motion/test"
DOCUMENT: Final = Path(__file__).parents[3] / "openapi" / "openapi.json"
SAID: Final = {409: "let in", 403: "refused", 405: "no POST there"}
"""Meaning of a status where nothing is carried out."""
Scope = tuple[str, ...] | None


class Everybody(Callers):
    """A caller for each role and scope, named by both."""

    def __init__(self, app: Application, keys: Keys) -> None:
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


def cells(app: Application, most: int | None) -> Iterator[tuple[Row, Role, Scope]]:
    """Each path of the API, as a command would ask for it; `most` scopes on each side."""
    # The page at / has no topic: a command has to name a path.
    routes = sorted((it for it in routes_of(app) if it[1] != "/"), key=lambda it: it[0] == "POST")
    for row in {path: row_of(method, path) for method, path in routes}.values():
        scopes = (None, *IN[row.about][:most], *OUT[row.about][:most])
        posted = replace(row, method="POST")
        yield from ((posted, role, scope) for role, scope in product(Role, scopes))


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


@pytest.mark.timeout(900)
@pytest.mark.parametrize(
    "most", [pytest.param(1, marks=pytest.mark.long), pytest.param(None, marks=pytest.mark.prove)]
)
def test_the_verdict_is_that_of_http_for_every_operation_role_and_scope(
    most: int | None, tmp_path: Path
) -> None:
    keys = Keys(tmp_path)
    plant = whole_plant()
    app = create_app(plant, keys.credentials)
    app.access = Probing(plant)
    operations = Operations(json.loads(DOCUMENT.read_text("utf-8")))
    differ: list[str] = []
    verdicts: Counter[str] = Counter()

    async def run() -> None:
        commands = Commands(ROOT, Everybody(app, keys), Figures(), operations.find)
        for row, role, scope in cells(app, most):
            is_secret = row.path.startswith(SECRETS)
            by_http = 403 if is_secret else await asked(app, row, keys.header(role, *scope or ()))
            by_mqtt = await verdict(commands, lambda: command(name_of(role, scope), row.target))  # noqa: B023
            verdicts["secret" if is_secret else SAID.get(by_http, str(by_http))] += 1
            if by_http != by_mqtt:
                differ.append(f"{row}: {role} {scope}: {by_http} over HTTP, {by_mqtt} over MQTT")

    asyncio.run(run())
    assert differ == []
    assert verdicts["let in"] > 1_000 < verdicts["refused"]
    print(f"{verdicts.total()} verdicts of {len(set(routes_of(app)))} operations: {dict(verdicts)}")


def test_what_the_api_does_not_document_is_not_asked_over_mqtt(tmp_path: Path) -> None:
    app = create_app(whole_plant(), Keys(tmp_path).credentials)
    documented = json.loads(DOCUMENT.read_text("utf-8"))["paths"]
    pages = [path for method, path in routes_of(app) if method == "POST" and path not in documented]
    assert pages
    assert [it for it in pages if not it.startswith(SECRETS)] == []
