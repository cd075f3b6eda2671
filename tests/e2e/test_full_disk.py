"""A disk that is full while motors are asked to move, and has room again."""

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.e2e.processes import Gateway, SimulatedLine, gateway_at, simulated_line, until

LOG_BYTES = 60_000


@pytest.fixture
def line(tmp_path: Path) -> Iterator[SimulatedLine]:
    """One of its own: the gateway of the other tests has the shared one."""
    with simulated_line(tmp_path) as line:
        yield line


@pytest.fixture
def gateway(line: SimulatedLine) -> Iterator[Gateway]:
    with gateway_at(line, "full") as gateway:
        yield gateway.wait_until_ready()


def test_what_has_an_effect_waits_for_room_and_stops_do_not(line: SimulatedLine, gateway: Gateway) -> None:
    gateway.ended("3F", gateway.moving("3F", 100)["id"])
    (known,) = line.executed("1+M")
    with no_room(gateway):
        refused = gateway.move("3F", 100)
        assert (refused.status_code, refused.json()["title"]) == (503, "The journal cannot be written")
        assert (refused.json()["moved"], refused.headers["retry-after"].isdigit()) == ("no", True)
        ready = gateway.http.get("/readyz")
        assert (ready.status_code, ready.json()["journal"]) == (200, "unavailable")
        assert gateway.http.get("/bodies/3F/position").status_code == 200
        assert gateway.http.post("/bodies/3F/stop").json()["confirmed"]
        assert line.executed("1+M") == [known]
        [alarm] = [
            alarm for alarm in gateway.get("/alarms")["alarms"] if alarm["cause"] == "gateway.journal.trouble"
        ]
        assert "No space left on device" in alarm["en"]["happened"]
    until(lambda: gateway.get("/readyz")["journal"] == "ready", "the journal is written again")
    gateway.ended("3F", gateway.moving("3F", 100)["id"])
    assert len(line.executed("1+M")) == 2
    assert "stop" in {deed["effect"] for deed in gateway.get("/audit?target=3F")["deeds"]}
    assert gateway.http.post(f"/alarms/{alarm['id']}/reset").status_code == 200


@contextmanager
def no_room(gateway: Gateway) -> Iterator[None]:
    """No file of a gateway can grow, but for its log: that of the journal is longer than this."""
    pid = gateway.program.pid
    soft, hard = resource.prlimit(pid, resource.RLIMIT_FSIZE)
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (LOG_BYTES, hard))
    try:
        yield
    finally:
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (soft, hard))
