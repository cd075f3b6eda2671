"""A gateway that is suspended: it accepts connections, and answers nothing."""

import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.e2e.processes import until
from tests.fleet.plants import Plant, needs_engine, plant_of, told

pytestmark = needs_engine

ANSWERED_S = 4.0
"""Two seconds, and what a busy machine adds."""


@pytest.fixture
def plant(tmp_path: Path) -> Iterator[Plant]:
    with plant_of(tmp_path) as plant:
        yield plant


def test_a_suspended_gateway_holds_nothing_up_and_stops_as_soon_as_it_goes_on(plant: Plant) -> None:
    process, (one, two) = plant.process, plant.gateways
    process.get("/bodies")
    for it in plant.gateways:
        it.line.begin_anew()
    two.program.signal(signal.SIGSTOP)
    try:
        begin = time.monotonic()
        stopped = process.http.post("/stop")
        assert time.monotonic() - begin < ANSWERED_S
        assert stopped.status_code == 409
        assert {it["gateway"]: it["state"] for it in told(stopped)["gateways"]} == {
            "stocker1": "confirmed",
            "stocker2": "unreached",
        }
        assert one.line.executed("5SS")
        begin = time.monotonic()
        bodies = {it["body_id"]: it["unheard"] for it in process.get("/bodies")["bodies"]}
        assert time.monotonic() - begin < ANSWERED_S
        assert bodies["stocker1:line1.3F"] is False
        assert bodies["stocker2:line1.3F"] is True
        begin = time.monotonic()
        leased = process.http.post("/leases", json={"scopes": ["stocker1:line1", "stocker2:line1"]})
        assert time.monotonic() - begin < ANSWERED_S
        assert leased.status_code == 409
        assert process.get("/leases")["leases"] == [], "half of it would keep others out"
    finally:
        two.program.signal(signal.SIGCONT)
    until(lambda: two.line.executed("5SS"), "it has stopped though nobody waits for it any more")
