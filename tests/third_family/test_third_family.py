"""A family that one entry of the registry brings is configured, served, moved, stopped and followed."""

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx2
import pytest
from httpx2 import ASGITransport, AsyncClient

from api.app import create_app
from gateway.access.credentials import Credentials
from gateway.access.keys import KeyStore
from gateway.access.roles import Role
from gateway.config import parse
from gateway.core.toml_files import ConfigError
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
    async with bench_of(LINE + OPEN) as bench:
        await story(bench)


@asynccontextmanager
async def bench_of(text: str, credentials: Credentials | None = None) -> AsyncIterator[Bench]:
    """Serve a configuration."""
    machine = ToyMachine()
    machine.homed = True
    plant = Plant(parse(text, "toy.toml"), open_transport=lambda _: SimulatedCable(machine))
    await plant.start()
    await asyncio.sleep(0.5)
    transport = ASGITransport(create_app(plant, credentials), raise_app_exceptions=False)
    async with AsyncClient(transport=transport, base_url=f"http://{HOST}") as client:
        yield Bench(plant, machine, client)
    await plant.close()


def test_its_lines_are_configured_in_its_own_words(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ConfigError, match=r"x:3: lines\[0\].protocol: must be 'rorze' or 'fics'"):
        parse(LINE, "x")
    monkeypatch.setitem(FAMILIES, "toy", Toys)
    with pytest.raises(ConfigError, match=r"x:5: lines\[0\].toi: unknown key \(did you mean toy"):
        parse(LINE.replace("toy =", "toi ="), "x")
    with pytest.raises(ConfigError, match=r"lines\[0\].toy: has no meaning on a line of protocol rorze"):
        parse(LINE.replace('protocol = "toy"\n', ""), "x")


STATUS = {"place": 0, "speed": 100, "moves": False, "stopped": False, "alarm": 0, "newest": 0, "life": 1}


@on_bench
async def test_its_rows_have_routes_that_answer_in_their_types(bench: Bench) -> None:
    answer = await bench.post(f"{TOY}/commands/get-status")
    assert (answer.status_code, answer.json()) == (200, STATUS)
    assert float(answer.headers["age-ms"]) >= 0
    answer = await bench.post(f"{TOY}/commands/set-speed", {"speed": 1000})
    assert answer.json()["detail"].startswith("speed: must be 999 or less")
    assert (await bench.post("/toys/t2/commands/get-status")).status_code == 404


@on_bench
async def test_a_command_that_moves_makes_a_move_with_its_events(bench: Bench) -> None:
    move = await bench.post(f"{TOY}/commands/go?wait=30", {"place": 100})
    assert (move.status_code, move.json()["status"]) == (200, "succeeded")
    assert (await bench.client.get(move.headers["location"])).json() == move.json()
    assert (await bench.client.get(f"{TOY}/moves")).json() == {"moves": [move.json()]}
    assert [news for news in bench.types() if news.startswith("toy.move")] == [
        "toy.move.queued",
        "toy.move.sent",
        "toy.move.started",
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
    asked = await bench.post(f"{TOY}/commands/get-status")
    assert (asked.status_code, asked.json()["type"].rpartition(":")[2]) == (409, "no-reply")
    bench.machine.mute = False
    fences = sum(command == "get-status" for command in bench.machine.heard)
    assert (await bench.post(f"{TOY}/commands/get-status")).status_code == 200
    assert sum(command == "get-status" for command in bench.machine.heard) > fences


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
    await bench.post(f"{TOY}/commands/go?wait=30", {"place": 100})
    move = (await bench.post(f"{TOY}/commands/go", {"place": 9000})).json()
    missed = (await bench.client.get("/events?after=00000000-000000000001&limit=2")).json()["events"]
    assert [event["type"] for event in missed] == ["stream.gap", "stream.snapshot"]
    now = missed[1]["data"]
    assert (now["toys"], now["bodies"]) == (
        [{"drive_id": "t1", "online": True, "moving": True, "alarm": 0}],
        [],
    )
    assert [move["id"] for move in now["moves"]] == [move["id"]]
    figures = (await bench.client.get("/metrics")).text
    assert 'motion_gateway_toys{kind="moving",line="bench"} 1.0' in figures
    assert 'motion_gateway_moves_total{line="bench",outcome="succeeded"} 1.0' in figures


@on_bench
async def test_its_events_pass_a_filter_by_its_address(bench: Bench) -> None:
    await bench.post(f"{TOY}/commands/go?wait=30", {"place": 100})
    answer = await bench.client.get("/events?bodies=t1")
    found = answer.json()["events"]
    news = [event["type"].removeprefix("toy.move.") for event in found]
    assert news == ["queued", "sent", "started", "succeeded"]


@on_bench
async def test_a_lease_keeps_it_for_its_holder(bench: Bench) -> None:
    lease = await bench.post("/leases", {"scope": "t1", "ttl_s": 10})
    assert (lease.status_code, lease.json()["covers"]) == (201, ["t1"])
    refused = await bench.post(f"{TOY}/commands/go", {"place": 100})
    assert (refused.status_code, refused.json()["type"].rpartition(":")[2]) == (409, "lease")
    token = {"lease-token": str(lease.json()["token"])}
    begun = await bench.client.post(f"{TOY}/commands/go", json={"place": 100}, headers=token)
    assert begun.status_code == 202


def test_a_scope_covers_it_by_its_address_and_by_its_line(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(FAMILIES, "toy", Toys)
    store = KeyStore(tmp_path)
    keys = {scope: store.create(f"of-{scope}", Role.OPERATOR, [scope]) for scope in ("t1", "bench", "t2")}

    async def story() -> None:
        async with bench_of(LINE, Credentials(store)) as bench:
            for scope, status in {"t1": 200, "bench": 200, "t2": 403}.items():
                header = {"authorization": f"Bearer {keys[scope]}"}
                answer = await bench.client.post(f"{TOY}/commands/get-status", headers=header)
                assert (scope, answer.status_code) == (scope, status)

    run_virtual(story())
