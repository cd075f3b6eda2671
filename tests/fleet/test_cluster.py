"""Three servers, three replicas: one at a time is killed, suspended, wiped, cut off; nothing is lost."""

import os
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from shutil import which

import pytest

from benchmarks.processes import free_port
from tests.e2e.processes import until
from tests.fleet.histories import Load
from tests.fleet.plants import Engine, needs_engine
from tests.fleet.test_histories import EVENTS_PER_S, GATEWAYS, Crowd, ip

pytestmark = [needs_engine, pytest.mark.prove, pytest.mark.long]

BRIDGE, NET = "mg-bridge", "10.213.78"


class Cluster:
    """Three servers that keep each message three times, each at a host of its own where there are such."""

    def __init__(self, folder: Path, within: Sequence[Sequence[str]] = ((), (), ())) -> None:
        hosts = [f"{NET}.{number + 2}" if it else "127.0.0.1" for number, it in enumerate(within)]
        ports = [free_port() for _ in hosts]
        routes = ", ".join(f'"nats://{host}:{port}"' for host, port in zip(hosts, ports, strict=True))
        self.servers = [
            Engine(
                folder / f"server{number}",
                host=host,
                within=within[number],
                more=f"server_name: s{number}\ncluster {{ name: plant, listen: {host}:{ports[number]}, "
                f"routes: [{routes}] }}",
                wait=False,
            )
            for number, host in enumerate(hosts)
        ]
        for server in self.servers:
            server.wait_until_well()
        self.url = '", "'.join(it.url for it in self.servers)
        self._turn = 0

    def next(self) -> Engine:
        """One after the other."""
        self._turn += 1
        return self.servers[self._turn % len(self.servers)]

    def kill(self) -> None:
        """End all."""
        for server in self.servers:
            server.kill()


def kill(cluster: Cluster) -> None:
    server = cluster.next()
    server.kill()
    time.sleep(3)
    server.start()


def suspend(cluster: Cluster) -> None:
    server = cluster.next()
    server.suspend()
    time.sleep(8)
    server.resume()


def wipe(cluster: Cluster) -> None:
    server = cluster.next()
    server.kill()
    server.wipe()
    server.start()


def cut_off(cluster: Cluster) -> None:
    cable = f"mg-cable{cluster.servers.index(cluster.next())}"
    ip("link", "set", cable, "down")
    time.sleep(8)
    ip("link", "set", cable, "up")


@pytest.fixture
def cabled(tmp_path: Path) -> Iterator[tuple[ExitStack, Cluster]]:
    """Three servers, each behind a cable of its own."""
    if os.geteuid() != 0 or which("ip") is None:
        pytest.skip("network namespaces take root and the command ip")
    with ExitStack() as stack:
        try:
            ip("link", "add", BRIDGE, "type", "bridge")
        except subprocess.CalledProcessError:
            pytest.skip("there are no bridges here")
        stack.callback(ip, "link", "del", BRIDGE)
        ip("addr", "add", f"{NET}.1/24", "dev", BRIDGE)
        ip("link", "set", BRIDGE, "up")
        for number in range(3):
            name, cable = f"mg-server{number}", f"mg-cable{number}"
            ip("netns", "add", name)
            stack.callback(ip, "netns", "del", name)
            ip("link", "add", cable, "type", "veth", "peer", "name", "eth0", "netns", name)
            ip("link", "set", cable, "master", BRIDGE, "up")
            ip("-n", name, "addr", "add", f"{NET}.{number + 2}/24", "dev", "eth0")
            ip("-n", name, "link", "set", "eth0", "up")
            ip("-n", name, "link", "set", "lo", "up")
        yield (
            stack,
            Cluster(tmp_path / "cluster", [("ip", "netns", "exec", f"mg-server{it}") for it in range(3)]),
        )


def judge(folder: Path, stack: ExitStack, cluster: Cluster, nemesis: Callable[[Cluster], None]) -> None:
    stack.callback(cluster.kill)
    crowd = Crowd(folder, stack, cluster.servers[0], cluster.url, "replicas = 3\n")
    load = Load(crowd.gateways, EVENTS_PER_S)
    load.start()
    for _ in range(4):
        time.sleep(3)
        nemesis(cluster)
        until(lambda: crowd.process.http.post("/stop").status_code == 200, "the plant stops")
    time.sleep(5)
    load.end()
    took_s = crowd.settle()
    count = crowd.judge()
    print(
        f"one of three, {nemesis.__name__}: {count} events of {GATEWAYS} gateways, whole after {took_s:.1f} s"
    )
    assert count > load.done


@pytest.mark.parametrize("nemesis", [kill, suspend, wipe])
def test_one_of_three_servers_costs_nothing_but_time(
    nemesis: Callable[[Cluster], None], tmp_path: Path
) -> None:
    with ExitStack() as stack:
        judge(tmp_path, stack, Cluster(tmp_path / "cluster"), nemesis)


def test_one_of_three_servers_behind_a_cut_cable_costs_nothing_but_time(
    cabled: tuple[ExitStack, Cluster], tmp_path: Path
) -> None:
    stack, cluster = cabled
    judge(tmp_path, stack, cluster, cut_off)
