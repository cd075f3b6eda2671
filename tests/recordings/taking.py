"""Recordings of plants in virtual time, for the stories about what is made of them."""

import asyncio
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from datetime import datetime, tzinfo
from pathlib import Path
from typing import Any, Final
from unittest.mock import patch

from httpx2 import ASGITransport, AsyncClient

from api.app import create_app
from gateway.door.state_log import note_states
from gateway.plant import Plant
from tests.api.stand import HOST
from tests.fics_plants import fics_rig
from tests.plants import rig
from tests.recordings.scripts import BODIES, ROBOT, Step
from tests.virtual_time import run_virtual

BEGAN_NS: Final = 1_764_000_000_000_000_000
CLOCKS: Final = ("transports.recorder", "gateway.recordings", "gateway.door.calls", "gateway.door.state_log")


def clocks() -> tuple[int, int]:
    """The clock of the running loop, in the place of both."""
    now = round(asyncio.get_running_loop().time() * 1e9)
    return BEGAN_NS + now, now


class WallTime(datetime):
    """A wall clock that goes as the running loop does."""

    @classmethod
    def now(cls, tz: tzinfo | None = None) -> "WallTime":
        return cls.fromtimestamp(clocks()[0] / 1e9, tz)


@contextmanager
def virtual_clocks() -> Iterator[None]:
    """Let all that is recorded have the time of the loop."""
    with ExitStack() as stack:
        for place in CLOCKS:
            stack.enter_context(patch(f"{place}.clocks", clocks))
        for place in ("gateway.core.events", "gateway.recordings"):
            stack.enter_context(patch(f"{place}.datetime", WallTime))
        yield


async def recorded(plant: Plant, folder: Path) -> Path:
    """Record all that a plant remembers."""
    plant.works.recordings.keep_in(folder)
    record = plant.works.recordings.start(None, asyncio.get_running_loop().time() + 1, 0)
    await plant.works.recordings.wait(record, 60)
    assert record.status == "finished", record.error
    return plant.works.recordings.file_of(record)


async def play(plant: Plant, script: Sequence[Step]) -> None:
    """Send the requests of a script on time."""
    noting = asyncio.create_task(note_states(plant))
    transport = ASGITransport(create_app(plant), raise_app_exceptions=False)
    async with AsyncClient(transport=transport, base_url=f"http://{HOST}") as client:
        requests = []
        for number, step in enumerate(script):
            headers = {"X-Request-Id": f"step-{number}"}
            asked = client.request(step.method, step.path, json=step.content, headers=headers)
            requests.append(asyncio.create_task(asked))
            await asyncio.sleep(step.then_s)
        await asyncio.wait(requests, timeout=60)
    noting.cancel()
    await asyncio.gather(noting, return_exceptions=True)


def bodies_at_work(folder: Path, script: Sequence[Step] = BODIES, **options: Any) -> Path:
    """Record bodies at work."""

    async def story() -> Path:
        async with rig(**{"baud": 9600, "groups": {}, "seed": 3, **options}) as running:
            await play(running.plant, script)
            return await recorded(running.plant, folder)

    with virtual_clocks():
        return run_virtual(story())


def robot_at_work(folder: Path, script: Sequence[Step] = ROBOT, **options: Any) -> Path:
    """Record a robot at work."""

    async def story() -> Path:
        async with fics_rig(**{"units": 2, **options}) as running:
            await play(running.plant, script)
            return await recorded(running.plant, folder)

    with virtual_clocks():
        return run_virtual(story())


BOTH: Final[dict[str, Callable[..., Path]]] = {"rorze": bodies_at_work, "fics": robot_at_work}
