"""Messages to the service manager: ready, ending, and signs of life, which only working lines give."""

import asyncio
import gc
import itertools
import os
import resource
import socket
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from app.process import (
    KEPT_BACK,
    THRESHOLDS,
    Watchdog,
    connections_possible,
    expect_long_start,
    notify,
    short_collections,
    watchdog_wanted,
)
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


class Kept:
    """Something that the collector looks through."""

    other: "Kept"


def test_what_survived_is_not_looked_through_again() -> None:
    with short_collections():
        kept = [[number] for number in range(50_000)]
        gc.collect()
        assert len(gc.get_objects()) < 1_000
        assert len(kept) == 50_000


def test_so_many_objects_are_looked_through_at_most_before_they_are_set_aside() -> None:
    with short_collections():
        kept: list[object] = []
        longest = 0
        for number in range(200_000):
            kept.append([number])
            if number % 100 == 0:
                longest = max(longest, len(gc.get_objects()))
        young, middle, old = THRESHOLDS
        assert longest <= (young + 1) * (middle + 2) * (old + 2)


def test_what_was_there_at_the_start_puts_no_collection_off() -> None:
    full: list[int] = []

    def note(phase: str, info: dict[str, Any]) -> None:
        if phase == "start" and info["generation"] == 2:
            full.append(len(kept))

    at_the_start = [[number] for number in range(400_000)]
    gc.collect()
    kept: list[object] = []
    with short_collections():
        gc.callbacks.append(note)
        kept += ([number] for number in range(50_000))
        gc.callbacks.remove(note)
    assert len(at_the_start) == 400_000
    assert full[0] <= 25_000


def test_what_was_set_aside_is_freed_when_it_is_dropped() -> None:
    with short_collections():
        kept = Kept()
        gc.collect()
        seen = weakref.ref(kept)
        del kept
        assert seen() is None


def test_a_new_circle_is_collected() -> None:
    with short_collections():
        one, other = Kept(), Kept()
        one.other, other.other = other, one
        seen = weakref.ref(one)
        del one, other
        gc.collect()
        assert seen() is None


def test_afterwards_collections_are_as_before() -> None:
    before, callbacks = gc.get_threshold(), list(gc.callbacks)
    with short_collections():
        assert gc.get_threshold() == THRESHOLDS
    assert gc.get_threshold() == before
    assert gc.callbacks == callbacks


class Allowed:
    """The operating system's limits, soft and hard."""

    def __init__(self, soft: int, hard: int, monkeypatch: pytest.MonkeyPatch) -> None:
        self.limits = (soft, hard)
        monkeypatch.setattr(resource, "getrlimit", lambda _: self.limits)
        monkeypatch.setattr(resource, "setrlimit", self._set)

    def _set(self, _: int, limits: tuple[int, int]) -> None:
        self.limits = limits


def test_a_limit_that_can_be_raised_is_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    allowed = Allowed(256, 4096, monkeypatch)
    assert connections_possible(1000) == 1000
    assert allowed.limits == (1000 + KEPT_BACK, 4096)


def test_a_limit_that_is_high_enough_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    allowed = Allowed(65_536, 65_536, monkeypatch)
    assert connections_possible(1000) == 1000
    assert allowed.limits == (65_536, 65_536)


@pytest.mark.parametrize("soft", [resource.RLIM_INFINITY, 256])
def test_without_a_hard_limit_everything_is_possible(soft: int, monkeypatch: pytest.MonkeyPatch) -> None:
    Allowed(soft, resource.RLIM_INFINITY, monkeypatch)
    assert connections_possible(50_000) == 50_000


def test_a_hard_limit_that_is_too_low_limits_connections_and_is_told(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    allowed = Allowed(256, 512, monkeypatch)
    assert connections_possible(1000) == 512 - KEPT_BACK
    assert allowed.limits == (512, 512)
    assert "ulimit -n" in caplog.text
