"""A family that one entry of the registry brings is configured, served, moved, stopped and followed."""

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any

import httpx2
import pytest
from httpx2 import ASGITransport, AsyncClient

from api.app import create_app
from gateway.config import ConfigError, parse
from gateway.families import FAMILIES
from gateway.plant import Plant
from tests.api.stand import HOST
from tests.open_access import OPEN
from tests.simulated_line import SimulatedCable
from tests.third_family.family import Toys
from tests.third_family.machine import ToyMachine
from tests.virtual_time import run_virtual

LINE = '[[lines]]\nid = "bench"\nprotocol = "toy"\naddress = "tcp://127.0.0.1:1"\ntoy = "t1"\n'
TOY = "/toys/t1"


@dataclass
class Bench:
    """A gateway over a toy axis, with a client in front of it."""

    plant: Plant
    machine: ToyMachine
    client: AsyncClient

    async def post(self, path: str, content: object = None) -> httpx2.Response:
        return await self.client.post(path, json=content)

    def types(self) -> list[str]:
        hub = self.plant.events
        return [hub.event(number).type for number in range(hub.first, hub.last + 1)]


Story = Callable[[Bench], Coroutine[Any, Any, None]]


def on_bench(story: Story) -> Callable[[pytest.MonkeyPatch], None]:
    """Tell a story in virtual time; the family is one more entry of the registry."""

    def test(monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(FAMILIES, "toy", Toys)
        run_virtual(_told(story))

    return test


async def _told(story: Story) -> None:
    machine = ToyMachine()
    plant = Plant(parse(LINE + OPEN, "toy.toml"), open_transport=lambda _: SimulatedCable(machine))
    await plant.start()
    await asyncio.sleep(0.5)
    transport = ASGITransport(create_app(plant), raise_app_exceptions=False)
    async with AsyncClient(transport=transport, base_url=f"http://{HOST}") as client:
        await story(Bench(plant, machine, client))
    await plant.close()


def test_its_lines_are_configured_in_its_own_words(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ConfigError, match=r"x:3: lines\[0\].protocol: must be 'rorze' or 'fics'"):
        parse(LINE, "x")
    monkeypatch.setitem(FAMILIES, "toy", Toys)
    with pytest.raises(ConfigError, match=r"x:5: lines\[0\].toi: unknown key; did you mean toy"):
        parse(LINE.replace("toy =", "toi ="), "x")
    with pytest.raises(ConfigError, match=r"lines\[0\].toy: has no meaning on a line of protocol rorze"):
        parse(LINE.replace('protocol = "toy"\n', ""), "x")


@on_bench
async def test_its_rows_have_routes_that_answer_in_their_types(bench: Bench) -> None:
    answer = await bench.post(f"{TOY}/commands/get-place")
    assert (answer.status_code, answer.json()) == (200, {"place": 0, "moves": 0})
    assert float(answer.headers["age-ms"]) >= 0
    answer = await bench.post(f"{TOY}/commands/set-speed", {"speed": 1000})
    assert answer.json()["detail"].startswith("speed: must be 999 or less")
    assert (await bench.post("/toys/t2/commands/get-place")).status_code == 404


@on_bench
async def test_a_command_that_moves_makes_a_move_with_its_events(bench: Bench) -> None:
    move = await bench.post(f"{TOY}/commands/go?wait=30", {"place": 100})
    assert (move.status_code, move.json()["status"]) == (200, "succeeded")
    assert (await bench.client.get(move.headers["location"])).json() == move.json()
    assert (await bench.client.get(f"{TOY}/moves")).json() == {"moves": [move.json()]}
    assert [it for it in bench.types() if it.startswith("toy.move")] == [
        "toy.move.queued",
        "toy.move.sent",
        "toy.move.succeeded",
    ]


@on_bench
async def test_a_stop_is_proved_and_reported_with_those_of_other_families(bench: Bench) -> None:
    move = (await bench.post(f"{TOY}/commands/go", {"place": 9000})).json()
    await asyncio.sleep(1.0)
    stopped = (await bench.post("/stop")).json()
    assert stopped["confirmed"]
    assert (stopped["bodies"], stopped["robots"]) == ([], [])
    assert [toy["state"] for toy in stopped["toys"]] == ["confirmed"]
    await asyncio.sleep(1.0)
    found = await bench.client.get(f"{TOY}/moves/{move['id']}")
    assert found.json()["status"] == "stopped"
    assert (await bench.post(f"{TOY}/stop")).json()["toys"][0]["state"] == "confirmed"
    assert (await bench.post(f"{TOY}/commands/halt")).json()["confirmed"]


@on_bench
async def test_after_an_answer_that_stayed_away_a_fence_goes_before_all_else(bench: Bench) -> None:
    bench.machine.mute = True
    asked = await bench.post(f"{TOY}/commands/get-place")
    assert (asked.status_code, asked.json()["type"].rpartition(":")[2]) == (409, "no-reply")
    bench.machine.mute = False
    fences = sum(it.startswith("EC") for it in bench.machine.heard)
    assert (await bench.post(f"{TOY}/commands/get-place")).status_code == 200
    assert sum(it.startswith("EC") for it in bench.machine.heard) > fences


@on_bench
async def test_its_line_is_told_with_the_others(bench: Bench) -> None:
    (line,) = (await bench.client.get("/lines")).json()["lines"]
    assert (line["line_id"], line["protocol"], line["state"], line["toy_id"]) == (
        "bench",
        "toy",
        "ready",
        "t1",
    )
    assert (await bench.client.get("/lines/bench")).json()["toy_id"] == "t1"
    assert (await bench.client.get("/readyz")).status_code == 200


@on_bench
async def test_a_snapshot_tells_of_its_axes_and_figures_count_them(bench: Bench) -> None:
    move = (await bench.post(f"{TOY}/commands/go", {"place": 9000})).json()
    missed = (await bench.client.get("/events?after=00000000-000000000001&limit=2")).json()["events"]
    assert [it["type"] for it in missed] == ["stream.gap", "stream.snapshot"]
    now = missed[1]["data"]
    assert (now["toys"], now["bodies"]) == ([{"toy_id": "t1", "online": True, "moving": True}], [])
    assert [it["id"] for it in now["moves"]] == [move["id"]]
    figures = (await bench.client.get("/metrics")).text
    assert 'motion_gateway_toys{kind="moving",line="bench"} 1.0' in figures
