"""Messages to the service manager: ready, ending, and signs of life, which only working lines give."""

import asyncio
import itertools
import os
import socket
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from app.systemd import Watchdog, expect_long_start, notify, watchdog_wanted
from tests.fics_plants import fics_rig
from tests.plants import Rig, in_virtual_time, rig

WATCHDOG_S = 60.0
"""Seconds of `WatchdogSec`, as in packaging/motion-gateway.service."""


@pytest.fixture
def manager(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[socket.socket]:
    """The service manager's end."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as end:
        end.bind(str(tmp_path / "notify"))
        end.settimeout(60)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        yield end


def test_it_hears_what_is_told(manager: socket.socket) -> None:
    notify("READY=1", "STATUS=serving")
    assert manager.recv(100) == b"READY=1\nSTATUS=serving"


def test_it_waits_longer_for_a_start_that_takes_long(manager: socket.socket) -> None:
    expect_long_start(90.5, "looking over the journal")
    assert manager.recv(100) == b"EXTEND_TIMEOUT_USEC=90500000\nSTATUS=looking over the journal"


def test_a_name_without_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as end:
        end.bind(f"\0motion-gateway-{os.getpid()}")
        monkeypatch.setenv("NOTIFY_SOCKET", f"@motion-gateway-{os.getpid()}")
        notify("STOPPING=1")
        assert end.recv(100) == b"STOPPING=1"


@pytest.mark.parametrize("address", [None, "", "vsock:2:1", "/nowhere/notify"])
def test_without_a_manager_nothing_happens(address: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    if address is not None:
        monkeypatch.setenv("NOTIFY_SOCKET", address)
    notify("READY=1")


@pytest.mark.parametrize(
    ("environment", "wanted"),
    [
        ({}, False),
        ({"WATCHDOG_USEC": "60000000"}, True),
        ({"WATCHDOG_USEC": "60000000", "WATCHDOG_PID": str(os.getpid())}, True),
        ({"WATCHDOG_USEC": "60000000", "WATCHDOG_PID": "1"}, False),
    ],
)
def test_whether_signs_of_life_are_waited_for(
    environment: dict[str, str], wanted: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("WATCHDOG_USEC", "WATCHDOG_PID"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert watchdog_wanted() is wanted


def test_it_is_fed_when_every_line_has_worked_and_once_a_second_at_most() -> None:
    told: list[str] = []
    now = [0.0]
    watchdog = Watchdog(("a", "b"), told.append, lambda: now[0])
    for second, line, fed in (
        (1, "a", 0),
        (1.1, "a", 0),
        (1.2, "b", 1),
        (1.3, "b", 1),
        (2.2, "b", 1),
        (9, "a", 2),
    ):
        now[0] = second
        watchdog.worked(line)
        assert len(told) == fed, second
    assert set(told) == {"WATCHDOG=1"}


def pauses(rig_: Rig) -> list[float]:
    """Note each time at which the only line works."""
    at: list[float] = []
    (port,) = rig_.plant.ports().values()
    port.on_work = lambda: at.append(asyncio.get_running_loop().time())
    return at


def longest(at: list[float], begin: float, end: float) -> float:
    moments = [begin, *(sign for sign in at if begin <= sign <= end), end]
    return max(later - earlier for earlier, later in itertools.pairwise(moments))


def nothing(_: Rig) -> None:
    """It stays as it is."""


def switch_off(stand: Rig) -> None:
    stand.machine.power_off(asyncio.get_running_loop().time())


@pytest.mark.parametrize(
    ("bodies", "present", "happens"),
    [
        ((0, 1), (0, 1), nothing),
        ((0, 1), (0,), nothing),
        ((), (0,), nothing),
        ((0, 1), (0, 1), switch_off),
        ((), (0,), switch_off),
        ((0, 1), (0, 1), lambda stand: stand.wire.unplug()),
    ],
    ids=["all answer", "one is silent", "only the link master", "all off", "that off", "no port"],
)
def test_a_line_works_on_whatever_is_at_its_far_end(
    bodies: tuple[int, ...], present: tuple[int, ...], happens: Callable[[Rig], None]
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with rig(bodies=bodies, present=present, groups={}) as stand:
            worked, loop = pauses(stand), asyncio.get_running_loop()
            begin = loop.time()
            happens(stand)
            await asyncio.sleep(5 * WATCHDOG_S)
            assert longest(worked, begin, loop.time()) < WATCHDOG_S / 2

    story()


@in_virtual_time
async def test_a_line_with_a_robot_works_on_too() -> None:
    async with fics_rig() as stand:
        at: list[float] = []
        stand.robot.line.on_work = lambda: at.append(asyncio.get_running_loop().time())
        begin = asyncio.get_running_loop().time()
        await asyncio.sleep(2 * WATCHDOG_S)
        stand.cable.unplug()
        await asyncio.sleep(2 * WATCHDOG_S)
        assert longest(at, begin, asyncio.get_running_loop().time()) < WATCHDOG_S / 2


@in_virtual_time
async def test_a_line_whose_work_has_ended_says_nothing_more() -> None:
    async with rig() as stand:
        worked = pauses(stand)
        await stand.plant.lines["line1"].close()
        worked.clear()
        await asyncio.sleep(WATCHDOG_S)
        assert worked == []


def test_the_time_of_the_unit_is_the_time_that_is_tested() -> None:
    unit = Path(__file__).parents[2] / "packaging" / "motion-gateway.service"
    assert f"WatchdogSec={WATCHDOG_S:.0f}" in unit.read_text("utf-8").splitlines()
