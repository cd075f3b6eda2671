"""Liveness, readiness, figures and version."""

import asyncio
import tomllib
from pathlib import Path

from prometheus_client.parser import text_string_to_metric_families

from gateway.version import VERSION
from tests.api.common.test_idempotent_requests import client
from tests.api.robots.cell import HOME, UNIT, Cell, in_cell
from tests.api.stand import RELATIVE, Stand, on_stand
from tests.plants import in_virtual_time
from tests.world import World


@on_stand()
async def test_a_gateway_with_open_lines_is_ready(stand: Stand) -> None:
    assert (await stand.get("/livez")).json() == {"status": "alive"}
    ready = await stand.get("/readyz")
    assert (ready.status_code, ready.json()) == (
        200,
        {
            "ready": True,
            "lines": {"arm": "ready"},
            "journal": "ready",
            "detail": "All lines and the journal are ready.",
        },
    )


@on_stand()
async def test_a_gateway_without_its_line_lives_but_is_not_ready(stand: Stand) -> None:
    stand.port.unplug()
    assert (await stand.get("/livez")).status_code == 200
    ready = await stand.get("/readyz")
    assert (ready.status_code, ready.json()["ready"]) == (503, False)
    assert ready.json()["detail"] == "Not every line can be used: arm is down."


Figures = dict[tuple[str, str | None, str | None], float]


async def figures_of(source: Stand | Cell) -> Figures:
    """All samples that have no other labels than line and kind."""
    text = (await source.get("/metrics")).text
    samples = [sample for family in text_string_to_metric_families(text) for sample in family.samples]
    samples = [it for it in samples if it.labels.keys() <= {"line", "kind"}]
    return {(it.name, it.labels.get("line"), it.labels.get("kind")): it.value for it in samples}


def test_a_gateway_whose_journal_is_in_trouble_is_still_asked_to_read_and_to_stop(tmp_path: Path) -> None:
    @in_virtual_time
    async def story() -> None:
        (tmp_path / "file").write_text("in the way")
        async with World(tmp_path / "file").gateway() as plant, client(plant) as http:
            ready = await http.get("/readyz")
            assert (ready.status_code, ready.json()["ready"]) == (200, True)
            assert ready.json()["journal"] == "unavailable"
            assert "reads and stops are carried out" in ready.json()["detail"]
            assert (await http.post("/bodies/3F/stop")).json()["confirmed"]
            assert (await http.post("/bodies/3F/moves", json=RELATIVE)).status_code == 503

    story()


@on_stand()
async def test_the_figures_are_prometheus_text_by_line_and_kind(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    await stand.post("/bodies/3F/moves", RELATIVE)

    figures = await figures_of(stand)

    assert figures["motion_gateway_line_total", "arm", "frames_sent"] == len(stand.frames())
    assert figures["motion_gateway_bodies", "arm", "configured"] == 3
    assert figures["motion_gateway_bodies", "arm", "moving"] == 1
    assert figures["motion_gateway_line_ready", "arm", None] == 1
    assert figures["motion_gateway_events_total", None, None] == stand.plant.events.last


@in_cell()
async def test_the_line_of_a_robot_has_the_same_figures(cell: Cell) -> None:
    await cell.post(f"{UNIT}/moves", HOME)
    figures = await figures_of(cell)
    counters = (await cell.get("/lines/cell")).json()["counters"]
    assert figures["motion_gateway_line_total", "cell", "frames_sent"] == counters["frames_sent"] > 0
    assert figures["motion_gateway_line_ready", "cell", None] == 1
    for lane in ("stop", "command", "read"):
        assert figures["motion_gateway_waiting", "cell", lane] == 0
    assert figures["motion_gateway_robots", "cell", "configured"] == 1
    assert figures["motion_gateway_robots", "cell", "offline"] == 0
    assert figures["motion_gateway_robots", "cell", "moving"] == 1


@in_cell()
async def test_a_gateway_whose_robot_is_away_or_silent_is_not_ready(cell: Cell) -> None:
    ready = await cell.get("/readyz")
    assert (ready.json()["ready"], ready.json()["lines"]) == (True, {"cell": "ready"})
    cell.rig.cable.unplug()
    ready = await cell.get("/readyz")
    assert (ready.status_code, ready.json()["ready"]) == (503, False)
    assert ready.json()["lines"] == {"cell": "down"}
    cell.rig.lose_replies(frames=1_000)
    cell.rig.cable.plugged_in = True
    await asyncio.sleep(30)
    ready = await cell.get("/readyz")
    assert (ready.status_code, ready.json()["lines"]) == (503, {"cell": "silent"})
    info = (await cell.get("/lines/cell")).json()
    assert (info["state"], "baud rate" in info["down_reason"]) == ("silent", True)


@on_stand()
async def test_the_version_is_that_of_the_project(stand: Stand) -> None:
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))
    assert project["project"]["version"] == VERSION
    assert (await stand.get("/version")).json() == {"name": "motion-gateway", "version": VERSION}
