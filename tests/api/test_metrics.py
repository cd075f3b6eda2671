"""The figures for Prometheus: by its conventions, and all there from the start."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from prometheus_client.parser import text_string_to_metric_families

from gateway.door.metrics import COUNTED
from tests.api.stand import RELATIVE, Stand, on_stand, socket

DASHBOARD = Path(__file__).parents[2] / "docs" / "grafana-dashboard.json"
Series = dict[tuple[str, frozenset[tuple[str, str]]], float]


async def read(stand: Stand) -> tuple[str, Series]:
    text = (await stand.get("/metrics")).text
    samples = [sample for family in text_string_to_metric_families(text) for sample in family.samples]
    return text, {(it.name, frozenset(it.labels.items())): it.value for it in samples}


def value(series: Series, name: str, **labels: str) -> float:
    return series[f"motion_gateway_{name}", frozenset(labels.items())]


async def much_happens(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    await stand.post("/bodies/3F/moves?wait=30", RELATIVE)
    await stand.post("/bodies/3F/moves", {**RELATIVE, "distance": {"value": 900_000, "unit": "pulse"}})
    await stand.post("/bodies/3F/moves", RELATIVE)
    await stand.post("/bodies/3F/stop", {"mode": "immediate"})
    await stand.get("/bodies/77")
    await stand.get("/events?after=00000000-000000000007")
    stand.port.unplug()


@on_stand()
async def test_every_series_is_there_from_the_start(stand: Stand) -> None:
    _, before = await read(stand)
    await much_happens(stand)
    _, after = await read(stand)
    assert before.keys() == after.keys()
    assert before != after
    assert stand.plant.port("arm").counters.keys() <= set(COUNTED)


@on_stand()
async def test_what_happens_is_counted(stand: Stand) -> None:
    await much_happens(stand)
    _, series = await read(stand)
    assert value(series, "moves_total", line="arm", outcome="succeeded") == 1
    assert value(series, "moves_total", line="arm", outcome="stopped") == 1
    assert value(series, "stop_seconds_count", line="arm") == 1
    assert value(series, "exchange_seconds_count", line="arm") > 10
    assert value(series, "request_seconds_count", method="POST", code="4xx") == 1
    assert value(series, "request_seconds_count", method="GET", code="4xx") == 1
    assert value(series, "events_dropped_total", kind="gap") == 1
    assert value(series, "alarms", cause="line.down") == 1
    assert value(series, "line_use_percent", line="arm", kind="clients") >= 0
    assert value(series, "journal_ready") == 0


@on_stand()
async def test_who_is_connected_is_counted_until_it_goes(stand: Stand) -> None:
    async with socket(stand, "/events") as client:
        await client.message()
        _, during = await read(stand)
    await stand.get("/livez")
    _, after = await read(stand)
    assert value(during, "clients", kind="websocket") == 1
    assert value(during, "clients", kind="request") == 1, "who asks for the figures"
    assert value(after, "clients", kind="websocket") == 0


@on_stand()
async def test_names_have_units_as_prometheus_wants_them(stand: Stand) -> None:
    text, series = await read(stand)
    ours = {name for name, _ in series if name.startswith("motion_gateway_")}
    assert all(re.fullmatch("[a-z_]+", name) for name in ours)
    assert {kind for _, kind in types(text)} == {"counter", "gauge", "histogram"}
    for name, kind in types(text):
        assert (kind == "counter") == name.endswith("_total"), name
        assert (kind == "histogram") <= name.endswith("_seconds"), name
    assert any(name == "process_resident_memory_bytes" for name, _ in series)
    assert any(name == "motion_gateway_build_info" for name, _ in series)


def types(text: str) -> Iterator[Any]:
    return (tuple(it) for it in re.findall(r"# TYPE (motion_gateway_\S+) (\S+)", text))


@on_stand()
async def test_the_dashboard_asks_for_figures_and_labels_that_there_are(stand: Stand) -> None:
    _, series = await read(stand)
    labels = {name: {label for label, _ in its} for name, its in series}
    labels["motion_gateway_robots"] = labels["motion_gateway_bodies"]  # there is no robot here
    dashboard = json.loads(DASHBOARD.read_text("utf-8"))
    asked = [target["expr"] for panel in dashboard["panels"] for target in panel.get("targets", ())]
    assert len(asked) > 20
    for expression in asked:
        for name, its in re.findall(r"\b((?:motion_gateway|process)_\w+)(?:\{([^}]*)\})?", expression):
            wanted = set(re.findall(r"(\w+)=~?\"", its)) - {"job"}
            assert wanted <= labels[name], expression
    shown = " ".join(asked)
    ours = {re.sub("_(bucket|count|sum)$", "", name) for name in labels if name.startswith("motion_gateway")}
    assert {it for it in ours if it not in shown} <= {"motion_gateway_line_busy_seconds_total"}
