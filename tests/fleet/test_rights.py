"""TLS and least rights at the servers: the power of a thief with a gateway's credentials."""

import asyncio
import re
import ssl
from collections.abc import Awaitable, Callable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import nats
import pytest
from nats.aio.client import Client

from tests.certificates import write_certificate
from tests.e2e.processes import SimulatedLine, until
from tests.fleet.plants import BODIES, Engine, Member, Plant, PlantProcess, needs_engine

pytestmark = needs_engine

THIEF = "stocker1"
GUIDE = Path(__file__).parents[2] / "docs/plant.md"


def users(*gateways: str) -> str:
    """The rights that the guide gives each gateway, word by word."""
    (rights,) = re.findall(
        r"user: stocker1, password: \"\.\.\.\", permissions: \{(.*?)\} \}\n", GUIDE.read_text(), re.DOTALL
    )
    told = "".join(
        f'{{ user: {name}, password: "of-{name}", permissions: {{ {rights.replace("stocker1", name)} }} }}\n'
        for name in gateways
    )
    return f'authorization {{ users = [ {{ user: plant, password: "of-plant" }}\n{told} ] }}\n'


@pytest.fixture(scope="module")
def authority(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return write_certificate(tmp_path_factory.mktemp("tls"), "nats1")


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory, authority: tuple[Path, Path]) -> Iterator[Plant]:
    folder = tmp_path_factory.mktemp("guarded")
    tls = f'tls {{ cert_file: "{authority[0]}", key_file: "{authority[1]}" }}\n'
    with ExitStack() as stack:
        engine = Engine(folder / "engine", more=tls + users("stocker1", "stocker2"), scheme="tls")
        stack.callback(engine.kill)

        def as_(name: str) -> str:
            (folder / f"{name}.credentials").write_text(f"{name}:of-{name}\n")
            return f'credentials = "{folder}/{name}.credentials"\nca = "{authority[0]}"\n'

        process = PlantProcess(folder, engine.url, as_("plant"))
        stack.callback(process.end)
        gateways = []
        for name in ("stocker1", "stocker2"):
            (folder / name).mkdir()
            line = SimulatedLine(folder / name, BODIES)
            stack.callback(line.end)
            gateways.append(Member(folder / name, name, engine.url, line, plant=as_(name)))
            stack.callback(gateways[-1].end)
        process.wait_until({"stocker1": "online", "stocker2": "online"})
        yield Plant(engine, gateways, process)


def test_a_plant_over_tls_with_least_rights_does_all_that_a_plant_does(plant: Plant) -> None:
    for gateway in plant.gateways:
        gateway.wait_until_ready()
        until(partial(plant.process.has_up_to, gateway), f"the plant has all events of {gateway.name}")
    stopped = plant.process.http.post("/stop").json()
    assert {it["state"] for it in stopped["gateways"]} == {"confirmed"}


def with_stolen(plant: Plant, authority: Path, deed: Callable[[Client], Awaitable[Any]]) -> list[str]:
    """Do something with the credentials of stocker1, and give what the server refuses."""
    refused: list[str] = []

    async def note(error: Exception) -> None:
        refused.append(str(error))

    async def steal() -> None:
        context = ssl.create_default_context(cafile=authority)
        client = await nats.connect(
            plant.engine.url, user=THIEF, password=f"of-{THIEF}", tls=context, error_cb=note,
            inbox_prefix="_INBOX_stocker1",
        )  # fmt: skip
        try:
            await deed(client)
            for _ in range(100):
                await client.flush()
                if refused:
                    return
                await asyncio.sleep(0.02)
        finally:
            await client.close()

    asyncio.run(steal())
    return refused


@pytest.mark.parametrize(
    "subject",
    ["mg.stocker2.ev", "$KV.gateways.stocker2", "$KV.owners.stocker2.line1", "mg.stop", "mg.stocker2.stop.1"],
)
def test_a_stolen_credential_writes_in_nobody_elses_place(
    plant: Plant, authority: tuple[Path, Path], subject: str
) -> None:
    refused = with_stolen(plant, authority[0], lambda it: it.publish(subject, b"{}"))
    assert "permissions violation" in " ".join(refused).lower()


@pytest.mark.parametrize("subject", ["mg.*.ev", "mg.stocker2.>", "$KV.gateways.>", "_INBOX_plant.>", ">"])
def test_a_stolen_credential_reads_no_events(
    plant: Plant, authority: tuple[Path, Path], subject: str
) -> None:
    refused = with_stolen(plant, authority[0], lambda it: it.subscribe(subject))
    assert "permissions violation" in " ".join(refused).lower()


@pytest.mark.parametrize(
    "call",
    ["STREAM.PURGE.PLANT", "STREAM.DELETE.PLANT", "DIRECT.GET.PLANT.mg.stocker2.ev", "CONSUMER.CREATE.PLANT"],
)
def test_a_stolen_credential_does_nothing_to_the_stream(
    plant: Plant, authority: tuple[Path, Path], call: str
) -> None:
    refused = with_stolen(plant, authority[0], lambda it: it.publish(f"$JS.API.{call}", b""))
    assert "permissions violation" in " ".join(refused).lower()
