"""Each request that the API's page shows is done by the demo, and leaves no error on a controller."""

import asyncio
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import pytest
from httpx2 import Response

from gateway.access.roles import Role
from gateway.config_file import ConfigFile
from tests.api.access.guarded import Keys
from tests.app.demo_plant import Demo, demo
from tests.virtual_time import run_virtual

OPENAPI: Final = Path(__file__).parents[2] / "openapi" / "openapi.json"
NOT_DONE: Final = ("failed", "unknown", "lost")
LONGEST_WAIT_S: Final = 60
SETTLING_S: Final = 2.0
"""More than a JOG lasts that is not kept alive, and than the gateway needs to see what became of it."""

pytestmark = pytest.mark.prove


class Shown(NamedTuple):
    """An example of a request body, and where the page sends it."""

    method: str
    path: str
    name: str
    names: dict[str, Any]
    body: Any

    def __str__(self) -> str:
        return f"{self.method} {self.path} {self.name}"


def shown() -> Iterator[Shown]:
    for path, item in json.loads(OPENAPI.read_text("utf-8"))["paths"].items():
        for method, operation in item.items():
            names = {
                parameter["name"]: parameter["example"]
                for parameter in operation.get("parameters", ())
                if parameter["in"] == "path" and "example" in parameter
            }
            for content in operation.get("requestBody", {}).get("content", {}).values():
                for name, example in content["examples"].items():
                    yield Shown(method.upper(), path, name, names, example["value"])


Request = tuple[str, str, Any]


def of_3f(command: str, **parameters: object) -> Request:
    return "POST", f"/bodies/3F/commands/{command}", parameters


LONG_WAY: Final = {"kind": "relative", "direction": "cw", "distance": {"value": 500_000, "unit": "pulse"}}
PROGRAM: Final = {"source": "*ST1\nWAT 1\n*TS\nEND"}
IN_REACH: Final = {axis: {"value": value, "unit": "mm"} for axis, value in (("X", 150), ("Y", 140), ("Z", 0))}
MOVING: Final = ("POST", "/bodies/3F/moves", LONG_WAY)
GROUP_MOVING: Final = ("POST", "/groups/80/moves", LONG_WAY)
PROGRAMMED: Final = ("PUT", "/bodies/3F/program", PROGRAM)
WITH_ENCODER: Final = of_3f("set-operating-mode", mode="encoder")
WITH_SERVO: Final = of_3f("set-operating-mode", mode="servo")
HOMED: Final = ("POST", "/robots/r1/units/1/moves?wait=60", {"kind": "home"})
AT_HAND: Final = ("POST", "/robots/r1/units/1/moves?wait=60", {"kind": "absolute", "axes": IN_REACH})
TAUGHT: Final = (
    "PUT",
    "/robots/r1/units/1/positions",
    {"positions": [{"number": number, "axes": IN_REACH} for number in (1, 1999)]},
)
FIRST: Final[dict[str, list[Request]]] = {
    r"/bodies/.*(/speed|/change-speed) ": [MOVING],
    r"/groups/.*/change-speed ": [GROUP_MOVING],
    r"/groups/.*/set-adjustment": [("POST", "/groups/80/commands/set-operating-mode", {"mode": "encoder"})],
    r"/groups/.*/set-clear-": [("POST", "/groups/80/commands/set-operating-mode", {"mode": "servo"})],
    r"/groups/.*/(run|step)-program |/groups/.*/get-program-": [
        ("PUT", f"/bodies/{member}/program", PROGRAM) for member in ("00", "01")
    ],
    r"/bodies/.*/program/runs |/bodies/.*/(run|step)-program |/bodies/.*/get-program-": [PROGRAMMED],
    r"/bodies/.*/set-adjustment": [WITH_ENCODER],
    r"/bodies/.*/set-clear-": [WITH_SERVO],
    r"/robots/.*(absolute|relative|step|position|step-axis|start-jog|macro|example)$": [HOMED, AT_HAND],
    r"/robots/.*(/move-|step-axis|start-jog|run-macro|/runs )": [HOMED, AT_HAND],
    r"/robots/.*/moves position|/move-to-position ": [TAUGHT],
}
"""Requests that go before, by a pattern of the examples that need them, as their documentation says."""

NEEDS_A_FILE: Final = ("/lines", "/lines/{line_id}/bodies", "/system/reload")
NEEDS_KEYS: Final = ("/access/keys", "/access/keys/{name}/rotate")
NEEDS_ANOTHER_GATEWAY: Final = ("/lines/{line_id}/take-over",)
"""Tried in tests/fleet/test_take_over.py."""
NEEDS_COMMISSIONING: Final = ("/commissionings", "/commissionings/{commissioning_id}/settings")
"""Tried in tests/api/test_commissionings.py: the demo of these tests opens no port."""
ELSEWHERE: Final = NEEDS_A_FILE + NEEDS_KEYS + NEEDS_ANOTHER_GATEWAY + NEEDS_COMMISSIONING


async def prepared(demo: Demo, example: Shown) -> dict[str, Any]:
    """Do what has to be done before, and give the names in the path."""
    made: dict[str, Any] = {}
    for pattern, requests in FIRST.items():
        for method, path, body in requests if re.search(pattern, str(example)) else ():
            answer = await demo.client.request(method, path, json=body)
            assert answer.is_success, answer.text
            made = {"move_id": answer.json().get("id")}
            await asyncio.sleep(SETTLING_S)
            if method == "PUT":
                await ended(demo, answer)
    return {**example.names, **made}


async def ended(demo: Demo, answer: Response) -> None:
    """Wait for the end of what was accepted and has a place of its own."""
    if answer.status_code == 202 and "Location" in answer.headers:
        await end_of(demo, answer.headers["Location"])


async def end_of(demo: Demo, place: str) -> None:
    """Wait until a move or an upload is over; a move without an end goes on."""
    for _ in range(LONGEST_WAIT_S):
        record = (await demo.client.get(place)).json()
        if record.get("status") != "running":
            break
        await asyncio.sleep(1.0)
    assert record.get("status") not in NOT_DONE, record


async def do(demo: Demo, example: Shown) -> None:
    """Send it, wait for the ends of the moves that it begins, and look for errors."""
    names = await prepared(demo, example)
    answer = await demo.client.request(example.method, example.path.format_map(names), json=example.body)
    assert answer.is_success, answer.text
    told = answer.json() if answer.content else {}
    assert [
        example["error"]
        for example in told.get("members", ())
        if isinstance(example, dict) and example["error"]
    ] == []
    if example.path != "/system/scans":  # there is no such port here, and its scan says so
        await ended(demo, answer)
    for move in told.get("moves", ()):
        await end_of(demo, f"/bodies/{move['body_id']}/moves/{move['id']}")
    await asyncio.sleep(SETTLING_S)
    alarms = (await demo.client.get("/alarms")).json()["alarms"]
    assert [alarm["en"]["happened"] for alarm in alarms] == []


@pytest.mark.parametrize(
    "example", [example for example in shown() if example.path not in ELSEWHERE], ids=str
)
def test_the_demo_does_what_is_shown(example: Shown) -> None:
    async def story() -> None:
        async with demo() as running:
            await do(running, example)

    run_virtual(story())


@pytest.mark.parametrize("example", [example for example in shown() if example.path in NEEDS_A_FILE], ids=str)
def test_a_gateway_with_a_file_does_what_is_shown(tmp_path: Path, example: Shown) -> None:
    file = tmp_path / "gateway.toml"
    file.write_text(
        'server = { line_networks = ["192.0.2.0/24", "127.0.0.0/8"] }\n'
        '[[lines]]\nid = "line1"\naddress = "tcp://127.0.0.1:1"\nbodies = [{ id = "3F" }]\n'
    )

    async def story() -> None:
        async with demo() as running:
            running.plant.file = ConfigFile(file)
            await do(running, example)

    run_virtual(story())


@pytest.mark.parametrize("example", [example for example in shown() if example.path in NEEDS_KEYS], ids=str)
def test_a_gateway_with_keys_does_what_is_shown(tmp_path: Path, example: Shown) -> None:
    keys = Keys(tmp_path)
    if "{name}" in example.path:
        keys.store.create(example.names["name"], Role("operator"), None)

    async def story() -> None:
        async with demo(keys.credentials) as running:
            running.client.headers.update(keys.header("admin"))
            await do(running, example)

    run_virtual(story())
