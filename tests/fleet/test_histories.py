"""Histories under kills, suspensions and partitions: nothing lost, doubled or reordered within a gateway."""

import os
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from shutil import which
from typing import Any, Final

import pytest

from tests.e2e.processes import SimulatedLine, until
from tests.fleet.histories import Load, journal_of, judge
from tests.fleet.plants import BODIES, Engine, Member, PlantProcess, needs_engine, stored

pytestmark = [needs_engine, pytest.mark.prove, pytest.mark.long]

GATEWAYS: Final = int(os.environ.get("GATEWAYS", "4"))
EVENTS_PER_S: Final = 200
NAMESPACE: Final = "mg-engine"
_LINK: Final = "mg-plant0"


class Crowd:
    """An engine, gateways and a plant process, under load."""

    def __init__(
        self, folder: Path, stack: ExitStack, engine: Engine, servers: str = "", extra: str = ""
    ) -> None:
        self.engine, self.servers = engine, servers or engine.url
        stack.callback(engine.kill)
        self.process = PlantProcess(folder, self.servers, extra)
        stack.callback(self.process.end)
        self.gateways = []
        for number in range(1, GATEWAYS + 1):
            own = folder / f"stocker{number}"
            own.mkdir()
            line = SimulatedLine(own, BODIES)
            stack.callback(line.end)
            self.gateways.append(Member(own, f"stocker{number}", self.servers, line))
            stack.callback(self.gateways[-1].end)
        for gateway in self.gateways:
            gateway.wait_until_ready()

    def settle(self) -> float:
        """Wait until the plant has everything, and tell how long that took."""
        begin = time.monotonic()
        for gateway in self.gateways:
            until(partial(self.process.has_up_to, gateway), f"the plant has all of {gateway.name}")
        return time.monotonic() - begin

    def judge(self) -> int:
        """Compare all journals with the stream, and the plant process with both; gives the events."""
        in_stream = stored(self.servers)
        events, _ = self.process.events()
        assert not [it for it in events if it["type"] == "stream.gap"]
        for gateway in self.gateways:
            of_gateway = [id_ for subject, id_ in in_stream if subject == f"mg.{gateway.name}.ev"]
            judge(journal_of(gateway), of_gateway)
            assert [it["id"] for it in events if it["gateway"] == gateway.name] == of_gateway
        return len(in_stream)


def kill_the_engine(crowd: Crowd) -> None:
    crowd.engine.kill()
    time.sleep(2)
    crowd.engine.start()


def suspend_the_engine(crowd: Crowd) -> None:
    crowd.engine.suspend()
    time.sleep(5)
    crowd.engine.resume()


def kill_a_gateway(crowd: Crowd) -> None:
    gateway = crowd.gateways[int(time.monotonic()) % len(crowd.gateways)]
    gateway.kill()
    gateway.start()


def kill_the_plant_process(crowd: Crowd) -> None:
    crowd.process.http.close()
    crowd.process.program.kill()
    crowd.process.start()


@pytest.fixture
def crowd(tmp_path: Path) -> Iterator[Crowd]:
    with ExitStack() as stack:
        yield Crowd(tmp_path, stack, Engine(tmp_path / "engine"))


@pytest.mark.parametrize(
    "nemesis", [kill_the_engine, suspend_the_engine, kill_a_gateway, kill_the_plant_process]
)
def test_nothing_is_lost_doubled_or_reordered(crowd: Crowd, nemesis: Callable[[Crowd], None]) -> None:
    load = Load(crowd.gateways, EVENTS_PER_S)
    load.start()
    for _ in range(3):
        time.sleep(2)
        nemesis(crowd)
    time.sleep(2)
    load.end()
    took_s = crowd.settle()
    count = crowd.judge()
    print(f"{nemesis.__name__}: {count} events of {GATEWAYS} gateways, whole after {took_s:.1f} s")
    assert count > load.done


def ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True)  # noqa: S603, S607


@pytest.fixture
def partition(tmp_path: Path) -> Iterator[Crowd]:
    """A crowd whose engine is behind a cable of its own."""
    if os.geteuid() != 0 or which("ip") is None:
        pytest.skip("network namespaces take root and the command ip")
    with ExitStack() as stack:
        try:
            ip("netns", "add", NAMESPACE)
        except subprocess.CalledProcessError:
            pytest.skip("there are no network namespaces here")
        stack.callback(ip, "netns", "del", NAMESPACE)
        ip("link", "add", _LINK, "type", "veth", "peer", "name", "eth0", "netns", NAMESPACE)
        ip("addr", "add", "10.213.77.1/30", "dev", _LINK)
        ip("link", "set", _LINK, "up")
        ip("-n", NAMESPACE, "addr", "add", "10.213.77.2/30", "dev", "eth0")
        ip("-n", NAMESPACE, "link", "set", "eth0", "up")
        within = ("ip", "netns", "exec", NAMESPACE)
        yield Crowd(tmp_path, stack, Engine(tmp_path / "engine", host="10.213.77.2", within=within))


def test_a_cut_cable_costs_nothing_but_time(partition: Any) -> None:
    crowd: Crowd = partition
    load = Load(crowd.gateways, EVENTS_PER_S)
    load.start()
    for _ in range(2):
        time.sleep(2)
        ip("link", "set", _LINK, "down")
        time.sleep(8)
        assert crowd.process.http.post("/stop").status_code == 200
        ip("link", "set", _LINK, "up")
    time.sleep(3)
    load.end()
    took_s = crowd.settle()
    print(f"partition: {crowd.judge()} events, whole after {took_s:.1f} s")
