"""A gateway or a bridge that was away: clients are told so, and go on by themselves when it is back."""

from collections.abc import Iterator
from pathlib import Path
from uuid import uuid4

import pytest

from tests.bridges.opcua.stand import BODIES, Bridge, Client, ClientError, Plant, client_of, node
from tests.e2e.processes import simulated_line, until

pytestmark = pytest.mark.prove
POSITION, ONLINE, MOVING = (f"line1.3F.{it}" for it in ("ActualPosition", "Online", "Moving"))
FIELDS = ["ConditionName", "SourceName", "Retain", "ActiveState.Id", "EventType"]


@pytest.fixture
def plant(tmp_path: Path) -> Iterator[Plant]:
    node()
    with simulated_line(tmp_path, BODIES) as line:
        plant = Plant(tmp_path, line)
        yield plant
        plant.end()


@pytest.fixture
def bridge(plant: Plant, tmp_path: Path) -> Iterator[Bridge]:
    bridge = Bridge(tmp_path, plant)
    yield bridge
    bridge.program.end()


@pytest.fixture
def client(bridge: Bridge, tmp_path: Path) -> Iterator[Client]:
    with client_of(tmp_path, bridge.trusted) as client:
        yield client.connect(bridge, reconnects=-1)


def status_of(client: Client, name: str) -> str:
    return str(client.read(name)[0]["status"])


def test_while_the_gateway_is_away_nothing_is_good_and_afterwards_the_same_session_goes_on(
    client: Client, bridge: Bridge, plant: Plant
) -> None:
    key = uuid4().hex
    first = client.move("line1.3F", 100, key)
    assert first["status"] == "Good"
    until(lambda: client.read(MOVING)[0]["value"] is False, "it stands")

    plant.program.kill()
    until(
        lambda: {status_of(client, it) for it in (POSITION, ONLINE, MOVING)} == {"BadNoCommunication"},
        "all is told as unknown",
    )
    refused = client.move("line1.3F", 100)
    assert refused["status"] == "BadResourceUnavailable"
    assert refused["outputs"][3], "a sentence"
    assert client.call("line1.3F", "Stop")["status"] == "BadResourceUnavailable"

    plant.start()
    until(lambda: status_of(client, POSITION) == status_of(client, ONLINE) == "Good", "values are good again")
    again = client.move("line1.3F", 100, key)
    assert (again["outputs"][0], again["outputs"][2]) == (first["outputs"][0], True)
    assert client.move("line1.3F", -100)["status"] == "Good"


def test_a_client_of_a_bridge_that_was_killed_goes_on_by_itself(
    client: Client, bridge: Bridge, plant: Plant
) -> None:
    client.tell("subscribe")
    assert client.tell("watch", fields=FIELDS) == "Good"
    client.tell("monitor", nodes=[POSITION])
    until(lambda: client.tell("values"), "the first value")
    key = uuid4().hex
    moved = client.move("line1.3F", 300, key)
    assert moved["status"] == "Good", moved
    until(lambda: client.read(MOVING)[0]["value"] is False, "it stands")
    plant.line.tell("PUT", "/bodies/00/power", on=False)
    raised = client.event(lambda it: it["ConditionName"] == "body.offline" and it["SourceName"] == "line1.00")
    client.tell("values")

    bridge.program.kill()
    bridge.start()

    def reads() -> bool:
        try:
            return status_of(client, ONLINE) == "Good"
        except ClientError:
            return False

    until(reads, "it is connected again")
    again = client.move("line1.3F", 300, key)
    assert (again["outputs"][0], again["outputs"][2]) == (moved["outputs"][0], True)
    until(lambda: client.tell("values"), "its subscription tells on")
    assert client.tell("refresh") == "Good"
    told = client.event(lambda it: it["ConditionName"] == "body.offline")
    assert told["ConditionId"] == raised["ConditionId"]

    plant.line.tell("PUT", "/bodies/00/power", on=True)
    over = client.event(lambda it: it["ConditionId"] == raised["ConditionId"] and not it["ActiveState.Id"])
    assert over["SourceName"] == "line1.00"
