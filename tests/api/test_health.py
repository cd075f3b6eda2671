"""Liveness, readiness, figures and version."""

import tomllib
from pathlib import Path

from prometheus_client.parser import text_string_to_metric_families

from api.version import VERSION
from tests.api.stand import RELATIVE, Stand, on_stand


@on_stand()
async def test_a_gateway_with_open_lines_is_ready(stand: Stand) -> None:
    assert (await stand.get("/livez")).json() == {"status": "alive"}
    ready = await stand.get("/readyz")
    assert (ready.status_code, ready.json()) == (200, {"ready": True, "lines": {"arm": "ready"}})


@on_stand()
async def test_a_gateway_without_its_line_lives_but_is_not_ready(stand: Stand) -> None:
    stand.port.unplug()
    assert (await stand.get("/livez")).status_code == 200
    ready = await stand.get("/readyz")
    assert (ready.status_code, ready.json()["ready"]) == (503, False)


@on_stand()
async def test_the_figures_are_prometheus_text_by_line_and_kind(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    await stand.post("/bodies/3F/moves", RELATIVE)

    text = (await stand.get("/metrics")).text
    samples = [sample for family in text_string_to_metric_families(text) for sample in family.samples]
    figures = {(it.name, it.labels.get("line"), it.labels.get("kind")): it.value for it in samples}

    assert figures["motion_gateway_line_total", "arm", "frames_sent"] == len(stand.frames())
    assert figures["motion_gateway_bodies", "arm", "configured"] == 3
    assert figures["motion_gateway_bodies", "arm", "moving"] == 1
    assert figures["motion_gateway_line_ready", "arm", None] == 1
    assert figures["motion_gateway_events_total", None, None] == stand.plant.events.last
    assert {label for sample in samples for label in sample.labels} == {"line", "kind"}


@on_stand()
async def test_the_version_is_that_of_the_project(stand: Stand) -> None:
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))
    assert project["project"]["version"] == VERSION
    assert (await stand.get("/version")).json() == {"name": "motion-gateway", "version": VERSION}
