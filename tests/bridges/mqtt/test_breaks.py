"""Bridge, gateway and broker end without a word and come back: states are told again, no event is missing."""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from benchmarks.processes import resident_mib
from bridges.mqtt.outbox import MOST_WAITING
from tests.bridges.mqtt.stand import BODIES, MES, Bridge, Broker, Client, Plant, at, bridging, relative
from tests.e2e.processes import simulated_line, until

EVENTS = 2 * MOST_WAITING
GROWN_MIB = 8.0


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plant]:
    """A plant that may be broken."""
    folder = tmp_path_factory.mktemp("plant")
    with simulated_line(folder, BODIES) as line:
        plant = Plant(folder, line)
        yield plant
        plant.end()


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Broker]:
    broker = Broker(tmp_path)
    yield broker
    broker.kill()


@pytest.fixture
def bridge(plant: Plant, broker: Broker, tmp_path: Path) -> Iterator[Bridge]:
    with bridging(tmp_path, plant, broker) as bridge:
        yield bridge.wait_until_online()


@pytest.fixture
def client(broker: Broker, bridge: Bridge) -> Iterator[Client]:  # it has to run
    with at(broker) as client:
        client.last("status", lambda it: it["state"] == "online")
        yield client


def test_the_broker_tells_that_a_bridge_is_gone_and_its_next_life_leaves_no_event_out(
    client: Client, bridge: Bridge, plant: Plant
) -> None:
    first = client.command("/bodies/3F/moves?wait=30", relative())["body"]
    bridge.program.kill()
    gone = client.last("status", lambda it: it["state"] == "offline")
    assert gone["reason"] == "the bridge is gone"
    meanwhile = plant.http.post("/bodies/3F/moves?wait=30", json=relative()).json()
    bridge.start()
    client.last("status", lambda it: it["state"] == "online")
    for move in (first, meanwhile):
        event = client.last_event("body.move.succeeded", move["id"])
        assert event["data"]["position"] == move["position"]
    told = list(dict.fromkeys(it["id"] for it in client.events()))
    assert told == sorted(told)


def test_a_bridge_that_is_told_to_end_says_so(client: Client, bridge: Bridge) -> None:
    assert bridge.program.end() == 0
    assert client.last("status", lambda it: it["state"] == "offline")["reason"] == "the bridge has ended"


def test_a_broker_that_has_lost_everything_is_told_everything(bridge: Bridge, broker: Broker) -> None:
    broker.kill()
    until(lambda: not bridge.figure('connected{to="broker"}'), "the bridge has noticed")
    broker.start()
    bridge.wait_until_online()
    with at(broker) as late:
        assert late.last("status", lambda it: it["state"] == "online")
        for topic in ("bodies/line1.00/state", "bodies/line1.3F/state", "lines/line1/state"):
            assert late.last(topic)
        moved = late.command("/bodies/3F/moves?wait=30", relative())
    assert moved["status"] == 200, "commands are heard again"


def leased(plant: Plant) -> Any:
    """Take a lease, no sooner than a key may have the next one."""
    time.sleep(0.06)
    return plant.http.post("/leases", json={"scope": "line1.3F"}).raise_for_status().json()


@pytest.mark.prove
def test_while_the_broker_is_away_the_bridge_does_not_grow_and_the_gateway_keeps_the_events(
    bridge: Bridge, broker: Broker, plant: Plant
) -> None:
    broker.kill()
    until(lambda: not bridge.figure('connected{to="broker"}'), "the bridge has noticed")
    before_mib, cursor = resident_mib(bridge.program.pid), plant.get("/events?limit=1000")["cursor"]
    for _ in range(EVENTS // 2):
        lease = leased(plant)
        token = {"Lease-Token": str(lease["token"])}
        plant.http.delete(f"/leases/{lease['lease']}", headers=token).raise_for_status()
    assert resident_mib(bridge.program.pid) - before_mib < GROWN_MIB
    broker.start()
    with at(broker) as late:
        happened: list[str] = []
        while page := plant.get(f"/events?after={cursor}&limit=1000")["events"]:
            happened += [it["id"] for it in page]
            cursor = page[-1]["cursor"]
        assert len(happened) >= EVENTS
        until(lambda: happened[-1] in [it["id"] for it in late.events()], "the last event arrives")
        heard = list(dict.fromkeys(it["id"] for it in late.events()))
        assert heard[-len(happened) :] == happened, "each, in its order"


def test_while_the_gateway_is_away_the_status_says_so(client: Client, bridge: Bridge, plant: Plant) -> None:
    plant.program.kill()
    away = client.last("status", lambda it: it["state"] == "offline")
    assert "gateway" in away["reason"]
    answer = client.command("/bodies/3F/moves", relative(), CorrelationData=b"away")
    assert (answer["status"], answer["moved"]) == (503, "no")
    plant.start()
    client.last("status", lambda it: it["state"] == "online")
    assert client.last_event("gateway.crashed")
    answer = client.command("/bodies/3F/moves?wait=30", relative(), CorrelationData=b"away")
    assert (answer["status"], answer["replayed"]) == (200, False), "the key is not used up"


def test_what_is_no_longer_there_is_taken_back_from_the_broker(
    client: Client, bridge: Bridge, plant: Plant
) -> None:
    for topic in ("bodies/line1.77/state", "alarms/long-over", "robots/r9/units/1/state"):
        client.publish(topic, {"stale": True}, retain=True)
    bridge.program.kill()
    bridge.start()
    until(lambda: client.of("alarms/long-over")[-1].payload == b"", "the alarm is taken back")
    until(lambda: client.of("bodies/line1.77/state")[-1].payload == b"", "the body is taken back")
    until(lambda: client.of("robots/r9/units/1/state")[-1].payload == b"", "the unit is taken back")
    assert client.of("bodies/line1.3F/state")[-1].payload


def test_a_command_that_no_bridge_has_heard_is_not_carried_out_later(
    client: Client, bridge: Bridge, plant: Plant
) -> None:
    moved = len(plant.moves())
    bridge.program.kill()
    client.publish(
        f"cmd/{MES}/bodies/3F/moves", relative(), CorrelationData=b"late", MessageExpiryInterval=60
    )
    bridge.start().wait_until_online()
    client.command("/bodies/3F/commands/get-position")
    assert len(plant.moves()) == moved, "nobody was there when it was published"
