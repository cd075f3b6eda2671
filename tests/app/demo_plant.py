"""The plant of `serve --demo` in one process with its machines, on virtual time."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from httpx2 import ASGITransport, AsyncClient

from api.app import create_app
from app.demo import BODIES, LINE, ROBOT, demo_config
from app.demo_faults import DemoFaults, SimulatedPlant
from gateway.access.credentials import Credentials
from gateway.core.journal.opening import open_journal
from simulator.demo import teach
from simulator.fics.layout import Layout
from simulator.fics.line import build_line as build_fics
from simulator.rorze.line import build_line
from tests.api.stand import HOST
from tests.fics_plants import SET_UP_S
from tests.plants import is_known
from tests.simulated_line import SimulatedCable, SimulatedLine
from tests.tested_plant import TestedPlant

RECHECK_S = 0.1


@dataclass
class Demo:
    """The demo's plant and a client in front of it."""

    plant: TestedPlant
    client: AsyncClient


@asynccontextmanager
async def demo(credentials: Credentials | None = None, data: Path | None = None) -> AsyncIterator[Demo]:
    """Start the demo and wait until its lines are up; with credentials its door is guarded.

    With a directory for data it has a journal.
    """
    now = asyncio.get_running_loop().time()
    config = demo_config(Path("/line1"), Path("/cell1"))
    if credentials:
        config = config.model_copy(update={"access": config.access.model_copy(update={"mode": "keys"})})
    line, robot = build_line(BODIES, now), build_fics(Layout(units=2))
    teach(line, now)
    ports = {LINE: SimulatedLine(line), "cell1": SimulatedCable(robot)}
    faults = DemoFaults(SimulatedPlant(line, ports[LINE], robot, ports["cell1"]), LINE, ROBOT)
    by_address = {line.address: ports[line.id] for line in config.lines}
    journal = open_journal(data, open_disk=faults.open_disk) if data else None
    plant = TestedPlant(config, open_transport=by_address.__getitem__, rng=Random(0), journal=journal)
    kept = TemporaryDirectory(ignore_cleanup_errors=True)
    plant.works.recordings.keep_in(data or Path(kept.name))
    await plant.start()
    try:
        await asyncio.sleep(SET_UP_S)
        while not all(is_known(body) for body in plant.bodies()):  # noqa: ASYNC110  # no event tells it
            await asyncio.sleep(RECHECK_S)
        transport = ASGITransport(create_app(plant, credentials, faults.rows()), raise_app_exceptions=False)
        async with AsyncClient(transport=transport, base_url=f"http://{HOST}") as client:
            yield Demo(plant, client)
    finally:
        await plant.close()
        kept.cleanup()
