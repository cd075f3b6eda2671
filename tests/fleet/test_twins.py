"""Two gateways with one name, as when a configuration was copied: nothing is sent to the wrong motor."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.e2e.processes import SimulatedLine, until
from tests.fleet.plants import BODIES, Engine, Member, Plant, PlantProcess, needs_engine, stored, told, wait

pytestmark = needs_engine

MOVE = {"kind": "relative", "direction": "cw", "distance": {"value": 40, "unit": "pulse"}}
LOOK_S = 4.0
"""Longer than the pause between two tries to forward events."""


@pytest.fixture
def twins(tmp_path: Path) -> Iterator[Plant]:
    with ExitStack() as stack:
        engine = Engine(tmp_path / "engine")
        stack.callback(engine.kill)
        process = PlantProcess(tmp_path, engine.url)
        stack.callback(process.end)
        gateways = []
        for folder in ("original", "copy"):
            (tmp_path / folder).mkdir()
            line = SimulatedLine(tmp_path / folder, BODIES)
            stack.callback(line.end)
            gateways.append(Member(tmp_path / folder, "stocker1", engine.url, line))
            stack.callback(gateways[-1].end)
            gateways[-1].wait_until_ready()
            until(lambda: process.states() == {"stocker1": "online"}, "it is heard")
        yield Plant(engine, gateways, process)


def conflict(process: PlantProcess) -> str | None:
    [gateway] = process.get("/gateways")["gateways"]
    return gateway["conflict"]  # type: ignore[no-any-return]


def test_two_gateways_with_one_name_are_told_and_no_command_goes_to_either(twins: Plant) -> None:
    process, (original, copy) = twins.process, twins.gateways
    said = until(lambda: conflict(process), "both are noticed")
    assert all(it.url in said for it in twins.gateways)
    refused = process.http.post("/bodies/stocker1:line1.3F/moves", json=MOVE)
    assert (refused.status_code, told(refused)["moved"]) == (409, "no")
    assert told(refused)["type"].endswith(":gateway-conflict")
    for it in twins.gateways:
        it.line.begin_anew()
    stopped = process.http.post("/stop")
    assert stopped.status_code == 409
    assert [it["state"] for it in told(stopped)["gateways"]] == ["unconfirmed"]
    for it in twins.gateways:
        until(lambda: it.line.executed("5SS"), "each has stopped what is its own")  # noqa: B023
        until(lambda: it.http.post("/stop").json()["confirmed"], "all of it stands")  # noqa: B023

    original.moving("3F", 40)
    [alarm] = until(lambda: original.get("/alarms?standing=true")["alarms"], "the first one says it")
    assert alarm["cause"] == "plant.unreachable"
    assert "calls itself stocker1, too" in original.program.words()
    for it in (copy, original):
        it.moving("3F", 40)
        wait(LOOK_S)
    ids = [id_ for _, id_ in stored(twins.engine.url)]
    assert len(ids) == len(set(ids)), "no journal is sent again and again"

    copy.end()
    until(lambda: conflict(process) is None, "it is gone")
    until(
        lambda: process.http.post("/bodies/stocker1:line1.3F/moves", json=MOVE).is_success,
        "the name means one gateway again",
    )
    assert process.http.post("/stop").is_success
