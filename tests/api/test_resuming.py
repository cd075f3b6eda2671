"""A thousand breaks of event streams, under load and over restarts: nothing lost, nothing out of order."""

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from random import Random

from api.app import Application, create_app
from gateway.core.errors import GatewayError
from protocols.rorze.moves import MoveClockwise, MoveCounterclockwise
from tests.api.stand import socket
from tests.api.test_streams import read_sent
from tests.plants import in_virtual_time
from tests.tested_plant import TestedPlant
from tests.world import World

LIVES, CLIENTS, CYCLES = 25, 8, 5
"""Lives of the gateway, its clients, and times that each client breaks off and resumes in each life."""
MOST_READ = 40
"""Events between two breaks."""
BURSTS = (1, 1, 1, 2, 30)
BURST_EVERY_S = 0.005
SHORT = 400


@dataclass
class Life:
    """A gateway between two restarts."""

    plant: TestedPlant
    app: Application

    def text(self, number: int) -> str:
        return self.plant.events.event(number).json

    def history(self) -> list[str]:
        """All that was ever told, as this life knows it."""
        return [self.text(number) for number in range(1, self.plant.events.last + 1)]


@dataclass
class Client:
    """Knows how far it has read, and nothing else."""

    streams: bool
    """Reads server-sent events, and not a WebSocket."""
    cursor: str
    position: int = 0
    breaks: int = 0

    async def read_on(self, life: Life, count: int) -> None:
        """Resume, take some events, and go without a word; what was sent beyond them is lost on the way."""
        self.breaks += 1
        read = self._from_stream if self.streams else self._from_socket
        async for cursor, text in read(life, count):
            self.position += 1
            assert text == life.text(self.position)
            self.cursor = cursor

    async def _from_stream(self, life: Life, count: int) -> AsyncIterator[tuple[str, str]]:
        frames = await read_sent(life, count, "/events/stream", **{"last-event-id": self.cursor})
        for frame in frames[:count]:
            yield frame["id"], frame["data"]

    async def _from_socket(self, life: Life, count: int) -> AsyncIterator[tuple[str, str]]:
        async with socket(life, f"/events?after={self.cursor}") as client:
            assert (await client.message())["type"] == "websocket.accept"
            for _ in range(count):
                text = (await client.message())["text"]
                yield json.loads(text)["cursor"], text


@asynccontextmanager
async def load(life: Life, dice: Random) -> AsyncIterator[None]:
    """Messages without end, and a motor that goes to and fro."""
    tasks = [asyncio.create_task(_talk(life.plant, dice)), asyncio.create_task(_move(life.plant))]
    try:
        yield
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.wait(tasks)


async def _talk(plant: TestedPlant, dice: Random) -> None:
    while True:
        for number in range(dice.choice(BURSTS)):
            plant.events.publish("line.message", "/lines/line1", {"frame": f">&7C{number}"})
        await asyncio.sleep(dice.expovariate(1 / BURST_EVERY_S))


async def _move(plant: TestedPlant) -> None:
    while True:
        for row in (MoveClockwise, MoveCounterclockwise):
            with suppress(GatewayError):  # until what the last life has left is known
                [move] = await plant.moves.start(plant.body("3F"), row(distance=SHORT))
                await plant.moves.wait(move.id, 60.0)
            await asyncio.sleep(0.05)


async def cycles(life: Life, client: Client, dice: Random) -> None:
    for _ in range(CYCLES):
        await client.read_on(life, dice.randint(1, MOST_READ))
        await asyncio.sleep(dice.expovariate(1 / BURST_EVERY_S))


@in_virtual_time
async def test_a_thousand_breaks_lose_and_reorder_nothing(tmp_path: Path) -> None:
    dice, world = Random(1), World(tmp_path / "data")
    clients: list[Client] = []
    durable: list[str] = []
    for number in range(LIVES):
        async with world.gateway() as plant:
            life = Life(plant, create_app(plant))
            clients = clients or [Client(place % 2 == 0, plant.events.cursor) for place in range(CLIENTS)]
            assert life.history()[: len(durable)] == durable
            crashes = number % 2 == 1
            async with load(life, dice):
                going = [asyncio.create_task(cycles(life, client, dice)) for client in clients]
                if crashes:
                    await asyncio.sleep(dice.uniform(0.0, 0.2))
                    world.crash()
                    durable = life.history()
                await asyncio.gather(*going)
        if not crashes:
            durable = life.history()
        for client in clients:
            client.position = min(client.position, len(durable))
    async with world.gateway() as plant:
        life = Life(plant, create_app(plant))
        for client in clients:
            last = plant.events.last  # it goes on while they read
            await client.read_on(life, last - client.position)
            assert client.position == last
    assert sum(client.breaks for client in clients) > LIVES * CLIENTS * CYCLES
