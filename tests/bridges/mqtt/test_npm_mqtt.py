"""The bridge as npm `mqtt` sees it, which most programs in JavaScript use."""

import json
import subprocess
from pathlib import Path

import pytest

from tests.bridges.mqtt.stand import ROOT, Bridge, Broker, Plant
from tests.clients.node import node

HERE = Path(__file__).parent
MODULES = HERE.parents[1] / "peers" / "node_modules"


def test_an_mes_in_javascript_moves_a_motor_once_and_hears_of_its_end(
    plant: Plant, broker: Broker, bridge: Bridge
) -> None:
    if not (MODULES / "mqtt").exists():
        pytest.skip("make test installs the peers")
    before = len(plant.moves())
    done = subprocess.run(  # noqa: S603  # our own
        [node(), str(HERE / "mes.cjs"), f"mqtt://127.0.0.1:{broker.port}", ROOT],
        env={"NODE_PATH": str(MODULES)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert (told["state"]["retain"], told["state"]["contentType"]) == (True, "application/json")
    assert told["state"]["content"]["online"] is True
    move = told["first"]["body"]
    assert (told["first"]["status"], told["first"]["replayed"], move["status"]) == (200, False, "succeeded")
    assert (told["again"]["replayed"], told["again"]["body"]["id"]) == (True, move["id"])
    assert (told["refused"]["status"], told["refused"]["moved"]) == (400, "no")
    assert told["ended"]["contentType"] == "application/cloudevents+json"
    assert (
        told["ended"]["content"]
        == plant.get(f"/events?after={move['event_cursor']}&types=body.move.succeeded")["events"][0]
    )
    assert len(plant.moves()) == before + 1
