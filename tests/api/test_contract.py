"""Schemathesis asks every operation what its description allows, and what it does not.

No case ends in a fault of the gateway, and no answer is other than the description says. `CASES=20000` asks
more than the few that every run has time for: `make fuzz`.
"""

import asyncio
import os
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import AsyncExitStack, suppress
from pathlib import Path
from random import Random
from typing import Any, Final
from urllib.parse import unquote_to_bytes, urlsplit

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis.errors import Unsatisfiable

from api.app import Application, create_app
from gateway.access.credentials import Credentials
from gateway.config import parse
from simulator.fics.layout import Layout
from simulator.fics.line import build_line as build_robot
from simulator.rorze.line import build_line
from tests.api.access.guarded import Keys
from tests.api.stand import HOST
from tests.fics_plants import CARTESIAN, SCARA, Cable
from tests.plants import Wire
from tests.simulated_line import Unplugged
from tests.tested_plant import TestedPlant
from tests.virtual_time import VirtualLoop

pytestmark = pytest.mark.prove

schemathesis = pytest.importorskip("schemathesis")

CASES: Final = int(os.environ.get("CASES", "2000"))
"""Over all operations; each is asked at least twice, with a key and without."""
ROOM: Final = "requests_per_key = 50000\nmoves_per_key_and_s = 10000\n"
CONFIG: Final = f"""
[server]
raw_commands = true
allow_endless_moves = true
[access]
{ROOM}
[[lines]]
id = "line1"
address = "tcp://127.0.0.1:1"
bodies = [{{ id = "00" }}, {{ id = "3F", units = {{ unit = "mm", pulses_per_unit = 1000.0 }} }}]
groups = [{{ id = "80", members = ["00", "3F"] }}]
[[lines]]
id = "cell"
address = "tcp://127.0.0.1:2"
protocol = "fics"
robot = {{ id = "r1", units = [{SCARA}, {CARTESIAN}] }}
"""
NAMES: Final = {"body_id": "3F", "group_id": "80", "line_id": "line1", "robot_id": "r1"}
"""Names of parts that exist; one case in three asks for other names."""
NOTHING_WAS_SENT: Final = 503


class Gateway:
    """A plant with a line and a robot in virtual time, and the application in front of it."""

    def __init__(self, folder: Path) -> None:
        self._loop = VirtualLoop()
        self._stack = AsyncExitStack()
        self.keys = Keys(folder)
        self.key = self.keys.header("admin")["authorization"]
        self.app: Application = self._loop.run_until_complete(self._open(self.keys.credentials))
        self.asked: Counter[int] = Counter()

    async def _open(self, credentials: Credentials) -> Application:
        ports = {
            "tcp://127.0.0.1:1": Wire(build_line((0x00, 0x3F), 0.0)),
            "tcp://127.0.0.1:2": Cable(build_robot(Layout(units=2))),
        }
        plant = TestedPlant(
            parse(CONFIG, "test.toml"),
            open_transport=lambda address: ports.get(address) or Unplugged(address),
            rng=Random(0),
        )
        await plant.start()
        self._stack.push_async_callback(plant.close)
        await asyncio.sleep(2)
        return create_app(plant, credentials)

    def close(self) -> None:
        self._loop.run_until_complete(self._stack.aclose())
        self._loop.close()

    def ask(self, case: Any, key: str | None) -> Any:
        """Send a case as a client would; gives the answer as Schemathesis takes it."""
        import requests
        from schemathesis.core.transport import Response

        kwargs = case.as_transport_kwargs(base_url=f"http://{HOST}")
        request = requests.Request(**{name: it for name, it in kwargs.items() if name != "timeout"}).prepare()
        if key is not None:
            request.headers["authorization"] = key
        status, headers, body = self._loop.run_until_complete(self._answer(request))
        self.asked[status] += 1
        return Response(status, headers, body, request, 0.0, verify=False)

    async def _answer(self, request: Any) -> tuple[int, dict[str, list[str]], bytes]:
        url = urlsplit(request.url)
        given = {name.lower(): value for name, value in request.headers.items()}
        given |= {"host": HOST, "accept-encoding": "identity"}
        content = request.body or b""
        told: list[Any] = []
        asked = iter(
            [{"type": "http.request", "body": content if isinstance(content, bytes) else content.encode()}]
        )

        async def receive() -> Any:
            return next(asked, {"type": "http.disconnect"})

        async def send(message: Any) -> None:
            told.append(message)

        scope = {
            "type": "http",
            "method": request.method,
            "scheme": "http",
            "path": unquote_to_bytes(url.path).decode("utf-8", "surrogateescape"),
            "raw_path": url.path.encode(),
            "query_string": url.query.encode(),
            "root_path": "",
            "headers": [(_bytes(name), _bytes(value)) for name, value in given.items()],
        }
        await self.app(scope, receive, send)
        headers: dict[str, list[str]] = {}
        for name, value in told[0]["headers"]:
            headers.setdefault(name.decode("latin-1"), []).append(value.decode("latin-1"))
        return told[0]["status"], headers, b"".join(it.get("body", b"") for it in told[1:])


def _bytes(text: str | bytes, encoding: str = "latin-1") -> bytes:
    return text if isinstance(text, bytes) else text.encode(encoding)


@pytest.fixture(scope="module")
def gateway(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Gateway]:
    it = Gateway(tmp_path_factory.mktemp("keys"))
    yield it
    it.close()


def strategies(gateway: Gateway) -> Iterator[Any]:
    """Requests to each operation: valid by its description, about known parts and any others, and invalid."""
    from schemathesis import GenerationMode

    document = gateway.app.openapi()
    for found in schemathesis.openapi.from_dict(document).get_all_operations():
        operation = found.ok()
        there = {name: value for name, value in NAMES.items() if f"{{{name}}}" in operation.path}
        yield operation.as_strategy(generation_mode=GenerationMode.POSITIVE, path_parameters=there or None)
        yield operation.as_strategy(generation_mode=GenerationMode.POSITIVE)
        yield operation.as_strategy(generation_mode=GenerationMode.NEGATIVE, path_parameters=there or None)


def ask_all(gateway: Gateway, strategy: Any, count: int) -> list[str]:
    """Draw cases, and send each with a key and without; gives what was wrong."""
    from schemathesis.core.failures import FailureGroup
    from schemathesis.specs.openapi import checks

    conformances = [
        checks.status_code_conformance,
        checks.content_type_conformance,
        checks.response_headers_conformance,
        checks.response_schema_conformance,
    ]
    wrong: list[str] = []

    def ask(case: Any) -> None:
        for key in (gateway.key, None):
            answer = gateway.ask(case, key)
            try:
                assert answer.status_code < 500 or answer.status_code == NOTHING_WAS_SENT, answer.text
                case.validate_response(answer, checks=conformances)
            except (AssertionError, FailureGroup) as fault:
                wrong.append(f"{case.as_curl_command()}: {answer.status_code}: {fault}")

    unhurried = settings(
        max_examples=count,
        derandomize=True,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    drawing: Callable[[], None] = unhurried(given(case=strategy)(ask))
    with suppress(Unsatisfiable):  # an operation without parameters can be asked in one way only
        drawing()
    return wrong


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_every_operation_answers_as_it_is_described(gateway: Gateway) -> None:
    drawn = list(strategies(gateway))
    each = max(1, -(-CASES // len(drawn) // 2))
    wrong = [fault for strategy in drawn for fault in ask_all(gateway, strategy, each)]
    print(dict(gateway.asked))  # what was asked, for people
    assert wrong == []
