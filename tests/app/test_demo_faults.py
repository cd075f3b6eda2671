"""Faults that the demo alone can play, and mend."""

from pathlib import Path

import pytest

from app.demo import BODIES, LINE, ROBOT
from app.demo_faults import GATEWAY, DemoFaults, SimulatedPlant
from gateway.core.errors import NotFound
from gateway.core.journal import writes
from gateway.core.journal.disk import NotWritable
from simulator.fics.layout import Layout
from simulator.fics.line import build_line as build_fics
from simulator.rorze.line import build_line
from tests.api.stand import Stand, on_stand
from tests.app.demo_plant import demo
from tests.simulated_line import SimulatedCable
from tests.virtual_time import run_virtual


def faults() -> DemoFaults:
    line, robot = build_line(BODIES, 0.0), build_fics(Layout(units=2))
    return DemoFaults(SimulatedPlant(line, SimulatedCable(line), robot, SimulatedCable(robot)), LINE, ROBOT)


def test_what_is_broken_twice_is_broken_once_and_all_is_mended_together() -> None:
    async def story() -> None:
        async with demo() as running:
            http = running.client
            for target in ("line1.3F", "LINE1.3f", "r1"):
                await http.post("/demo/faults", json={"kind": "ems", "target": target})
            standing = (await http.get("/demo/faults")).json()["faults"]
            assert [(fault["kind"], fault["target"]) for fault in standing] == [
                ("ems", "line1.3F"),
                ("ems", "r1"),
            ]
            assert (await http.delete("/demo/faults")).json()["faults"] == []
            assert (await http.get("/demo/faults")).json()["faults"] == []

    run_virtual(story())


def test_a_target_that_there_is_not_is_refused_with_those_there_are() -> None:
    async def story() -> None:
        async with demo() as running:
            refused = await running.client.post("/demo/faults", json={"kind": "dead", "target": "r1"})
            assert refused.status_code == 404
            assert refused.json()["detail"] == "Nothing was broken: dead is no fault of r1."
            assert "line1.3F" in refused.json()["remedy"]
            unknown = await running.client.post("/demo/faults", json={"kind": "fire"})
            assert unknown.status_code == 422

    run_virtual(story())


def test_without_a_target_the_first_is_broken_and_the_cable_of_a_body_is_its_lines() -> None:
    async def story() -> None:
        async with demo() as running:
            http = running.client
            first = (await http.post("/demo/faults", json={"kind": "ems"})).json()
            assert first["target"] == "line1.00"
            cable = await http.post("/demo/faults", json={"kind": "cable", "target": "line1.3F"})
            assert cable.json()["target"] == "line1"

    run_virtual(story())


def test_a_full_disk_takes_nothing_until_it_is_mended(tmp_path: Path) -> None:
    broken = faults()
    disk = broken.open_disk(tmp_path)
    assert broken.begin("disk", None).target == GATEWAY
    with pytest.raises(NotWritable, match="No space left on device"):
        disk.commit([writes.meta("a", "b")], durable=True)
    broken.end()
    disk.commit([writes.meta("a", "b")], durable=True)
    disk.close()


def test_there_is_no_disk_to_fill_without_a_journal() -> None:
    with pytest.raises(NotFound, match="has no journal"):
        faults().begin("disk", None)


@on_stand()
async def test_no_other_gateway_has_it(stand: Stand) -> None:
    for verb in ("GET", "POST", "DELETE"):
        assert (await stand.client.request(verb, "/demo/faults")).status_code == 404
    assert "/demo" not in (await stand.get("/openapi.json")).text
