"""Two plant processes side by side: any number of them serve the same plant."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest

from tests.e2e.processes import until
from tests.fleet.plants import Plant, PlantProcess, needs_engine, plant_of

pytestmark = needs_engine

MOVE = {"kind": "relative", "direction": "cw", "distance": {"value": 40, "unit": "pulse"}}


@pytest.fixture
def plant(tmp_path: Path) -> Iterator[Plant]:
    with plant_of(tmp_path) as plant:
        yield plant


def test_what_one_begins_the_other_goes_on_with(plant: Plant, tmp_path: Path) -> None:
    first, (_, two) = plant.process, plant.gateways
    (tmp_path / "second").mkdir()
    second = PlantProcess(tmp_path / "second", plant.engine.url)
    try:
        second.wait_until(first.states())
        _, cursor = first.events()
        path, key = "/bodies/stocker2:line1.3F/moves", {"Idempotency-Key": "lot-1", "Prefer": "wait=20"}
        with ThreadPoolExecutor() as both:
            asked = [both.submit(it.http.post, path, json=MOVE, headers=key) for it in (first, second)]
            answers = [it.result() for it in asked]
        assert len({it.json()["id"] for it in answers if it.is_success}) == 1
        assert len(two.line.executed("1+M")) == 1, "the journal of the owner decides"

        lease = first.http.post("/leases", json={"scopes": ["stocker1:line1", "stocker2:line1"]}).json()
        token = {"Lease-Token": lease["token"]}
        assert second.http.post(f"/leases/{lease['lease']}/renew", headers=token).is_success
        assert second.http.delete(f"/leases/{lease['lease']}", headers=token).is_success

        for it in plant.gateways:
            until(partial(first.has_up_to, it), "the first has everything")
            until(partial(second.has_up_to, it), "the second has everything")
        told = [[it["id"] for it in process.events(cursor)[0]] for process in (first, second)]
        assert sorted(told[0]) == sorted(told[1])
        assert len(told[0]) == len(set(told[0])) > 0

        with ThreadPoolExecutor() as both:
            stops = list(both.map(lambda it: it.http.post("/stop").status_code, (first, second)))
        assert stops == [200, 200], "twice does no harm"
    finally:
        second.end()
