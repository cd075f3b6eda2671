"""A gateway without network goes on by itself, the plant tells nothing old as new, and gets everything later.

`EVENTS=120000` asks for those of ten minutes at 200 a second.
"""

import os
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Final

import pytest

from tests.e2e.processes import SimulatedLine, until
from tests.fleet.cables import Cable
from tests.fleet.histories import Load, journal_of, judge
from tests.fleet.plants import BODIES, Engine, Member, PlantProcess, needs_engine, stored

pytestmark = [needs_engine, pytest.mark.prove, pytest.mark.long]

EVENTS: Final = int(os.environ.get("EVENTS", "6000"))


class CutOff:
    """A gateway with a cable to the engine and one to the plant process."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self.engine = Engine(folder / "engine")
        stack.callback(self.engine.kill)
        self._to_engine = Cable(self.engine.port)
        stack.callback(self._to_engine.end)
        line = SimulatedLine(folder, BODIES)
        stack.callback(line.end)
        self.gateway = Member(folder, "stocker1", f"nats://127.0.0.1:{self._to_engine.port}", line)
        stack.callback(self.gateway.end)
        self._to_plant = Cable(int(self.gateway.url.rpartition(":")[2]))
        stack.callback(self._to_plant.end)
        at = f'[plant.gateways]\nstocker1 = "http://127.0.0.1:{self._to_plant.port}"\n'
        self.process = PlantProcess(folder, self.engine.url, at)
        stack.callback(self.process.end)

    def cut(self) -> None:
        """Nothing reaches it, and nothing comes from it."""
        self._to_engine.cut()
        self._to_plant.cut()

    def mend(self) -> None:
        """Its cables are whole again."""
        self._to_engine.mend()
        self._to_plant.mend()


@pytest.fixture
def plant(tmp_path: Path) -> Iterator[CutOff]:
    with ExitStack() as stack:
        plant = CutOff(tmp_path, stack)
        plant.gateway.wait_until_ready()
        until(lambda: plant.process.states() == {"stocker1": "online"}, "the plant hears stocker1")
        yield plant


def test_a_gateway_without_network_goes_on_and_the_plant_gets_all_of_it(plant: CutOff) -> None:
    process, gateway = plant.process, plant.gateway
    assert [it["position"] for it in process.get("/bodies")["bodies"]] == [0, 0]
    until(lambda: process.has_up_to(gateway), "the plant has everything")
    plant.cut()

    moved = gateway.move("3F", 400, wait=20)
    assert moved.json()["status"] == "succeeded", moved.text
    assert gateway.http.post("/stop").json()["confirmed"]
    assert gateway.http.get("/readyz").is_success
    until(
        lambda: "plant.unreachable" in [it["cause"] for it in gateway.get("/alarms")["alarms"]],
        "stocker1 says that the plant does not hear it",
    )
    load = Load([gateway], 1_000_000.0)
    load.start()
    until(
        lambda: process.states() == {"stocker1": "unheard"}, "the plant says that it does not hear stocker1"
    )
    for body in process.get("/bodies")["bodies"]:
        assert body["unheard"], body
        assert "position" not in body, "nothing old is told as of now"
        assert body["last_known"]["position"] == 0
        assert body["heard_age_s"] > 0
    assert process.http.post("/stop").status_code == 409
    until(lambda: 2 * load.done >= EVENTS, f"{EVENTS} events have come", 600)
    load.end()

    plant.mend()
    begin = time.monotonic()
    until(lambda: process.has_up_to(gateway), "the plant has everything again", 120)
    took_s = time.monotonic() - begin
    print(f"cut off: {2 * load.done} events, whole {took_s:.1f} s after the cable was")
    assert process.http.post("/stop").status_code == 200
    assert [it["position"] for it in process.get("/bodies")["bodies"]] == [0, 400]
    judge(journal_of(gateway), [id_ for _, id_ in stored(plant.engine.url)])
