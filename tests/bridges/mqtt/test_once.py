"""Ten thousand commands, each published twice and again, while bridge, gateway and broker are killed."""

import threading
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Any, Final

import pytest

from tests.bridges.mqtt.stand import MES, Broker, Client, Heard, Plant, bridging, relative
from tests.bridges.mqtt.test_kills import kill
from tests.e2e.processes import SimulatedLine, simulated_line

COMMANDS: Final = 10_000
BODIES: Final = [f"{number:02X}" for number in range(30)]
"""Bodies whose commands are under way together; twice as many messages are fewer than the bridge takes."""
BAD_EVERY: Final = 20
"""Interval of the commands without an expiry, which have to be refused."""
SHORTEST: Final = 10
AGAIN_S: Final = 4.0
LIVES_S: Final = (6.0, 24.0)
VICTIMS: Final = ("bridge", "gateway", "broker")


class Command:
    """One move of one body: the controller's own log tells by its length how often it was done."""

    def __init__(self, body: str, number: int) -> None:
        self.body, self.pulses = body, SHORTEST + number
        self.correlation = f"{body}-{self.pulses}"
        self.is_bad = (number + BODIES.index(body)) % BAD_EVERY == 0
        self.move = {**relative(self.pulses), "direction": "cw" if number % 2 else "ccw"}
        self.answers: list[Any] = []
        self.published = 0
        self.again_at = 0.0

    def publish(self, client: Client) -> None:
        """Publish it twice, as clients do that are not sure."""
        expiry: dict[str, Any] = {} if self.is_bad else {"MessageExpiryInterval": 10}
        for _ in range(2):
            with suppress(RuntimeError):  # the broker is away
                client.publish(
                    f"cmd/{MES}/bodies/{self.body}/moves?wait=5",
                    self.move,
                    wait=False,
                    CorrelationData=self.correlation.encode(),
                    ResponseTopic=client.answers,
                    **expiry,
                )
                self.published += 1
        self.again_at = time.monotonic() + AGAIN_S

    @property
    def is_over(self) -> bool:
        """Say whether it has an answer after which no client repeats it: done, or refused for good."""
        return any(it["status"] < 300 or it["status"] == 400 for it in self.answers)


class Crowd:
    """A client that has one command under way at each body, until all have their answers."""

    def __init__(self, client: Client) -> None:
        self._client = client
        each = COMMANDS // len(BODIES)
        self._left = {body: [Command(body, it) for it in reversed(range(each))] for body in BODIES}
        self.all = {it.correlation: it for commands in self._left.values() for it in commands}
        self._lock = threading.Lock()
        client.on_heard = self._hear

    @property
    def left(self) -> int:
        """Number of commands without an answer yet."""
        return sum(map(len, self._left.values()))

    def work(self) -> None:
        """Publish what has no answer yet: the first of each body, and again after a while."""
        with self._lock:
            for commands in self._left.values():
                if commands and time.monotonic() >= commands[-1].again_at:
                    commands[-1].publish(self._client)

    def _hear(self, message: Heard) -> None:
        if message.topic == self._client.answers:
            with self._lock:
                command = self.all[message.properties.CorrelationData.decode()]
                command.answers.append(message.json)
                left = self._left[command.body]
                while left and left[-1].is_over:
                    left.pop()


@pytest.mark.prove
@pytest.mark.timeout(3000)
def test_none_is_carried_out_twice_and_each_is_answered(
    tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    dice, kills, begun_at = Random(COMMANDS), Counter[str](), time.monotonic()
    with simulated_line(tmp_path, ",".join(BODIES)) as line:
        broker, plant = Broker(tmp_path), Plant(tmp_path, line, ",".join(BODIES))
        request.addfinalizer(broker.kill)
        request.addfinalizer(plant.end)
        client = Client(broker.port)
        request.addfinalizer(client.close)
        with bridging(tmp_path, plant, broker) as bridge:
            crowd, kill_at = Crowd(client), time.monotonic() + LIVES_S[1]
            bridge.wait_until_online()
            while crowd.left:
                crowd.work()
                time.sleep(0.02)
                if time.monotonic() >= kill_at:
                    victim = VICTIMS[kills.total() % len(VICTIMS)]
                    kills[victim] += 1
                    kill(victim, plant, bridge, broker, lambda: None)
                    kill_at = time.monotonic() + dice.uniform(*LIVES_S)
        _judge(crowd, line)
    outcomes = Counter(_outcome(it) for it in crowd.all.values())
    published = sum(it.published for it in crowd.all.values())
    print(
        f"{len(crowd.all)} commands, published {published} times, {kills.total()} kills {dict(kills)}, "
        f"{dict(outcomes)}, 0 carried out twice, {time.monotonic() - begun_at:.0f} s"
    )
    refused = [it.answers for it in crowd.all.values() if _outcome(it) == "refused" and not it.is_bad]
    assert refused == []


def _judge(crowd: Crowd, line: SimulatedLine) -> None:
    starts = Counter(
        f"{it.body}-{it.facts['text'][3:]}" for code in ("1+M", "1-M") for it in line.executed(code)
    )
    assert [it for it, times in starts.items() if times > 1] == []
    for correlation, command in crowd.all.items():
        ids = {it["body"]["id"] for it in command.answers if it["status"] < 300}
        assert len(ids) <= 1, command.answers
        times = starts.pop(correlation, 0)
        if command.is_bad:
            assert times == 0
            assert all(it["moved"] == "no" for it in command.answers)
        elif _outcome(command) == "succeeded":
            assert times == 1, command.answers
    assert not starts, "nothing was done that nobody has asked for"


def _outcome(command: Command) -> str:
    done = [it for it in command.answers if it["status"] < 300]
    return str(done[-1]["body"]["status"]) if done else "refused"
