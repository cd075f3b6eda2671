"""kill -9 of bridge, gateway and broker: every event arrives, in order, and no command is done twice."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Any
from uuid import uuid4

import pytest

from tests.bridges.mqtt.stand import BODIES, MES, ROOT, Bridge, Broker, Client, Plant, at, bridging, relative
from tests.e2e.processes import simulated_line, until

KILLS, MANY_KILLS = 6, 300
REPEATED_AFTER_S = 2.0
"""Somebody who has no answer by then repeats the command."""
LIVES_S = (0.5, 3.0)
DOWN_S = (0.0, 0.5)


class Mover:
    """Commands one move after the other, each with its correlation, published twice until it is answered."""

    def __init__(self, broker: Broker, body: str) -> None:
        self._broker, self._body = broker, body
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._work)
        self.asked: list[str] = []
        self.answers: dict[str, list[Any]] = {}
        """By correlation, all that came."""

    def __enter__(self) -> "Mover":
        self._client = Client(self._broker.port)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._thread.join()
        self._client.close()

    def _work(self) -> None:
        while not self._ending.is_set():
            correlation = uuid4().hex
            self.asked.append(correlation)
            while not self._answered(correlation) and not self._ending.is_set():
                self._publish_twice(correlation)
                give_up_at = time.monotonic() + REPEATED_AFTER_S
                while time.monotonic() < give_up_at and not self._answered(correlation):
                    time.sleep(0.01)

    def _publish_twice(self, correlation: str) -> None:
        for _ in range(2):
            with suppress(RuntimeError):  # the broker is away
                self._client.publish(
                    f"cmd/{MES}/bodies/{self._body}/moves?wait=1",
                    relative(20),
                    wait=False,
                    CorrelationData=correlation.encode(),
                    ResponseTopic=self._client.answers,
                    MessageExpiryInterval=5,
                )

    def _answered(self, correlation: str) -> bool:
        """Tell if it has an answer after which it is not repeated."""
        mine = [
            it.json
            for it in list(self._client.heard)
            if it.topic == self._client.answers and it.properties.CorrelationData == correlation.encode()
        ]
        self.answers[correlation] = mine
        return any(it["status"] < 500 and it["status"] != 429 for it in mine)


@pytest.fixture
def plant(tmp_path: Path) -> Iterator[Plant]:
    with simulated_line(tmp_path, BODIES) as line:
        plant = Plant(tmp_path, line)
        yield plant
        plant.end()


@pytest.mark.parametrize(
    "kills", [pytest.param(KILLS, marks=pytest.mark.long), pytest.param(MANY_KILLS, marks=pytest.mark.prove)]
)
@pytest.mark.timeout(3000)
def test_every_event_arrives_in_order_and_no_command_is_carried_out_twice(
    kills: int, plant: Plant, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    broker, dice = Broker(tmp_path), Random(kills)
    request.addfinalizer(broker.kill)
    with at(broker, f"{ROOT}/events/#") as subscriber, bridging(tmp_path, plant, broker) as bridge:
        bridge.wait_until_online()
        begin = plant.get("/events?limit=1000")["cursor"]
        with Mover(broker, "00") as first, Mover(broker, "3F") as second:
            for victim in _victims(kills, dice):
                time.sleep(dice.uniform(*LIVES_S))
                kill(victim, plant, bridge, broker, lambda: time.sleep(dice.uniform(*DOWN_S)))
            bridge.wait_until_online()
        happened = _events_since(plant, begin)
        until(lambda: happened[-1]["id"] in _heard(subscriber), "the last event arrives")
        heard = list(_heard(subscriber))
    _judge_events(happened, heard)
    for mover in (first, second):
        _judge_commands(mover)
    asked = [*first.asked, *second.asked]
    starts = len(plant.moves())
    print(
        f"{kills} kills, {len(happened)} events, {len(heard)} heard, {len(asked)} commands, {starts} starts"
    )
    assert kills / 2 < starts <= len(asked)
    assert starts <= len({it["correlationid"] for it in happened if it["type"].startswith("body.move.")})


def _victims(kills: int, dice: Random) -> Iterator[str]:
    for _ in range(kills // 3):
        yield from dice.sample(["bridge", "gateway", "broker"], 3)


def kill(victim: str, plant: Plant, bridge: Bridge, broker: Broker, wait: Callable[[], None]) -> None:
    {"bridge": lambda: bridge.program.kill(), "gateway": lambda: plant.program.kill(), "broker": broker.kill}[
        victim
    ]()
    wait()
    {"bridge": bridge.start, "gateway": plant.start, "broker": broker.start}[victim]()


def _events_since(plant: Plant, cursor: str) -> list[Any]:
    """All that the gateway's journal has."""
    events: list[Any] = []
    while (page := plant.get(f"/events?after={cursor}&limit=1000"))["events"]:
        events += page["events"]
        cursor = page["cursor"]
    return events


def _heard(client: Client) -> dict[str, Any]:
    """By id, each event as it came first."""
    heard: dict[str, Any] = {}
    for event in client.events():
        assert heard.setdefault(event["id"], event) == event, "one id is one event"
    return heard


def _judge_events(happened: list[Any], heard: list[str]) -> None:
    ids = [it["id"] for it in happened]
    missing = set(ids) - set(heard)
    assert not missing, sorted(missing)
    order = {id_: place for place, id_ in enumerate(heard)}
    places = [order[id_] for id_ in ids]
    assert places == sorted(places), "they came in their order"


def _judge_commands(mover: Mover) -> None:
    """Each correlation stands for one move at most, whatever was answered how often."""
    by_move: dict[str, str] = {}
    for correlation, answers in mover.answers.items():
        ids = {it["body"]["id"] for it in answers if it["status"] < 300}
        assert len(ids) <= 1, answers
        for move_id in ids:
            assert by_move.setdefault(move_id, correlation) == correlation
    unanswered = [it for it in mover.asked[:-1] if not mover.answers[it]]
    assert not unanswered
