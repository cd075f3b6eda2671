"""A move of a SCARA robot that is asked for twice with one Idempotency-Key, with a crash in between."""

import asyncio
from pathlib import Path

import pytest

from simulator.rorze.line import build_line
from tests.api.common.test_idempotent_requests import client, is_replayed
from tests.api.scaras.test_moves import LINE
from tests.gateway.rorze_scara.cell import SCARA
from tests.gateway.rorze_scara.test_restart import BODIES, taught
from tests.plants import Wire, configuration, in_virtual_time
from tests.world import World

KEY = {"idempotency-key": "4711"}
MOVES = "/scaras/wafer/moves"


@pytest.mark.parametrize("frame", ["&8AHPS1,-10000", "&8AHMM"])
def test_it_is_made_once(frame: str, tmp_path: Path) -> None:
    @in_virtual_time
    async def story() -> None:
        text = configuration(bodies=BODIES, groups={}, more=SCARA)
        wire = Wire(build_line(BODIES, 0.0, seed=1), 9600)
        world = World(tmp_path / "data", wire, text)
        asked = {**LINE, "pattern": 5}
        async with world.gateway() as plant, client(plant) as http:
            await taught(plant, world)
            first = asyncio.create_task(http.post(MOVES, json=asked, headers=KEY))
            await wire.begun(frame)
            world.crash()
            move = (await first).json()
        await asyncio.sleep(5)
        async with world.gateway() as plant, client(plant) as http:
            again = await http.post(MOVES, json=asked, headers=KEY)
            assert is_replayed(again)
            assert (again.json()["id"], again.json()["scara_id"]) == (move["id"], "wafer")
            assert again.headers["location"] == f"{MOVES}/{move['id']}"
        assert len(world.sent("HMM")) <= 1

    story()
