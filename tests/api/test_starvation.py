"""Other programs take the processor: a stop goes out in few turns of the event loop, and the lag is told."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any, Final, NamedTuple

import httpx2
import pytest

from api.app import create_app
from gateway.access.principal import EVERYBODY, asking
from gateway.core.admission import BEAT_S, HELD_S
from gateway.core.errors import GatewayError
from gateway.core.move_record import MoveStatus
from gateway.core.origin import Origin
from gateway.core.targets import AnyCommand
from gateway.door import doing
from protocols.fics.status import GetUserPosition
from protocols.rorze.position import GetPosition
from simulator.rorze.line import build_line
from tests.open_access import OPEN
from tests.plants import Wire
from tests.tested_plant import TestedPlant
from tests.virtual_time import VirtualLoop, run_virtual
from tests.world import World

SLICE_S: Final = 0.004
"""Seconds that other processes take between two turns of the loop: a slice of a fair scheduler, assumed."""
LONGEST_S: Final = 0.05
"""Seconds from the request of a stop to its first byte, at most."""
READERS: Final = 12
STOPS: Final = 5
HELD: Final = "gateway.loop.held"


class Cell(NamedTuple):
    """A gateway's world, what moves in it, and how."""

    world: Callable[[Path], World]
    subject: str
    moves: str
    move: dict[str, Any]
    reads: str
    read: AnyCommand
    stop: str
    """The code of the first frame of a stop."""


def bodies(folder: Path) -> World:
    return World(folder, Wire(build_line([0x00, 0x3F], 0.0, seed=1), 115_200))


def robot(mode: int) -> Cell:
    def world(folder: Path) -> World:
        made = World.of_robot(folder, mode)
        made.text += OPEN
        return made

    unit = "/robots/r1/units/1"
    return Cell(world, "/robots/r1", f"{unit}/moves", UP, unit, GetUserPosition(), "AES")


UP: Final = {"kind": "relative", "coordinates": {"Z": {"value": -20.0, "unit": "mm"}}}
FAR: Final = {"kind": "relative", "direction": "cw", "distance": {"value": 20_000, "unit": "pulse"}}
CELLS: Final = {
    "bodies": Cell(bodies, "/bodies/3F", "/bodies/3F/moves", FAR, "/bodies/00", GetPosition(), "&3F5IS"),
    "robot, mode 2": robot(2),
    "robot, mode 3": robot(3),
}


@asynccontextmanager
async def client(plant: TestedPlant) -> AsyncIterator[httpx2.AsyncClient]:
    plant.admission.watch._clock = asyncio.get_running_loop().time
    plant.admission.watch.start()
    while any(port.state != "ready" for port in plant.ports().values()):  # noqa: ASYNC110
        await asyncio.sleep(0.1)
    transport = httpx2.ASGITransport(create_app(plant), raise_app_exceptions=False)
    async with httpx2.AsyncClient(transport=transport, base_url="http://127.0.0.1:8420") as http:
        yield http


@asynccontextmanager
async def readers(plant: TestedPlant, cell: Cell) -> AsyncIterator[None]:
    """People who ask again as soon as they are answered."""

    async def read() -> None:
        while True:
            with suppress(GatewayError), asking(EVERYBODY):
                await doing.do(plant, Origin("client", None), cell.reads, cell.read)

    tasks = [asyncio.create_task(read()) for _ in range(READERS)]
    try:
        yield
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def stop_takes_s(http: httpx2.AsyncClient, world: World, cell: Cell) -> float:
    """From the request of a stop to its first byte; and it is confirmed."""
    loop, before = asyncio.get_running_loop(), len(world.wire.frames())
    asked_at = loop.time()
    stopping = asyncio.create_task(http.post(f"{cell.subject}/stop", json={"mode": "immediate"}))
    while not stopping.done() and cell.stop not in world.wire.frames()[before:]:  # noqa: ASYNC110  # no event
        await asyncio.sleep(0)
    took_s = loop.time() - asked_at
    assert (await stopping).json()["confirmed"]
    assert cell.stop in world.wire.frames()[before:]
    return took_s


@pytest.mark.parametrize("name", CELLS)
def test_a_stop_goes_out_in_few_turns_whatever_waits(name: str, tmp_path: Path) -> None:
    cell = CELLS[name]

    async def story() -> None:
        world = cell.world(tmp_path / "data")
        async with world.gateway() as plant, client(plant) as http, readers(plant, cell):
            await asyncio.sleep(0.5)
            assert max([await stop_takes_s(http, world, cell) for _ in range(STOPS)]) <= LONGEST_S

    run_virtual(story(), SLICE_S)


def test_a_lag_is_told_and_what_moves_is_followed_and_stopped(tmp_path: Path) -> None:
    async def story() -> None:
        cell, loop = CELLS["bodies"], asyncio.get_running_loop()
        assert isinstance(loop, VirtualLoop)
        world = cell.world(tmp_path / "data")
        async with world.gateway() as plant, client(plant) as http:
            told: list[dict[str, Any]] = []
            plant.events.listeners.append(lambda it: told.append(it.data) if it.type == HELD else None)
            move = (await http.post(cell.moves, json=cell.move)).json()
            loop.be_held_for(2 * HELD_S)
            await stop_takes_s(http, world, cell)
            assert (await plant.moves.wait(move["id"], 60.0)).status is MoveStatus.STOPPED
        assert [it["cancelled"] for it in told] == [False]
        assert told[0]["seconds"] == pytest.approx(2 * HELD_S, abs=BEAT_S)

    run_virtual(story(), SLICE_S)
