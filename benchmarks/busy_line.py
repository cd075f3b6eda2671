"""A full line, 120 bodies at 9600 baud on a pty, on a machine with other work to do.

Measures the share of the line that health checks take at the start and at rest, the time of stops, and false
alarms.
"""

import asyncio
import os
import subprocess
import sys
from collections.abc import AsyncIterator, Iterator
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, sleep
from typing import NamedTuple

from benchmarks.figures import Figure, Target
from benchmarks.full_line import BAUD, BODIES, MOVERS, RECHECK_S, asked, wait_until_at_rest
from benchmarks.gateways import SWEEP_GROUPS, write_config
from benchmarks.http_client import Door, get, post
from benchmarks.processes import free_port, gateway, simulated_line
from benchmarks.stop_latency import FAR, FILL_S, teach_speeds

MEMBERS = 15
START_S = 20.0
MARKS_S = 60.0
"""Seconds after which all bodies have been looked at and their marks written, with half of the line."""
REST_S = 20.0
MOVES_S = 1.0
TRIES = 5
BUSY_LOOPS = 3
"""Programs that do nothing but take the processor."""
FIRST_GROUP = 0x80
SPIN = "while True: pass"
GROUPS = [
    (FIRST_GROUP + number, BODIES[MEMBERS * number : MEMBERS * (number + 1)])
    for number in range(len(BODIES) // MEMBERS)
]
PLANT_GROUPS = "".join(
    f'[[lines.groups]]\nid = "{number:02X}"\nmembers = {[f"{member:02X}" for member in members]}\n'
    for number, members in GROUPS
)


class Setting(NamedTuple):
    """A configuration, and the longest that stops may take with it."""

    name: str
    keys: str
    tables: str
    confirmed_s: float


SETTINGS = (
    Setting("no groups", "", "", 9.0),
    Setting("the plant's groups", "", PLANT_GROUPS, 6.0),
    Setting("sweep_groups", SWEEP_GROUPS, "", 6.0),
    Setting("both", SWEEP_GROUPS, PLANT_GROUPS, 6.0),
)


class Run(NamedTuple):
    """The results of one run."""

    start_percent: float
    rest_percent: float
    stopped_s: float
    unconfirmed: int
    alarms: int


async def run(_: float) -> list[Figure]:
    """Start, rest, move 30 and stop all, with each setting, on a machine at rest and on one that is busy."""
    figures: list[Figure] = []
    for loops in (0, BUSY_LOOPS):
        for setting in SETTINGS:
            with busy(loops):
                async with _line(setting) as port:
                    shown = await asyncio.to_thread(_run, port)
            figures += _figures(setting, loops, shown)
    return figures


def _figures(setting: Setting, loops: int, shown: Run) -> Iterator[Figure]:
    name = f"busy line, {setting.name}, {loops} busy loops"
    for what, unit, value, bound in (
        ("health in the first 20 s", "%", shown.start_percent, 50.0),
        ("health at rest", "%", shown.rest_percent, 12.0),
        ("all stops confirmed", "s", shown.stopped_s, setting.confirmed_s),
        ("not confirmed in the answer", "stops", shown.unconfirmed, 0),
        ("false alarms", "alarms", shown.alarms, 0),
    ):
        yield Figure(f"{name}: {what}", unit, [value], [100.0], Target("figure", "<=", bound))


def _run(port: int) -> Run:
    while asked(port, get("/lines/line"))["state"] != "ready":
        sleep(RECHECK_S)
    start = _most_percent(port, START_S)
    wait_until_at_rest(port)
    sleep(MARKS_S)
    rest = _most_percent(port, REST_S)
    teach_speeds(Door(port), MOVERS)
    for body in MOVERS:
        _move(port, body)
    sleep(MOVES_S)
    begun_at = monotonic()
    reports = asked(port, post("/stop", {"mode": "immediate"}))["bodies"]
    unconfirmed = sum(report["state"] != "confirmed" for report in reports)
    while (waiting := asked(port, get("/bodies"))) and any(body["moving"] for body in waiting["bodies"]):
        if monotonic() - begun_at > FILL_S:
            raise RuntimeError("not measured, because some bodies still move")
        sleep(RECHECK_S)
    stopped_s = monotonic() - begun_at
    alarms = asked(port, get("/alarms"))["alarms"]
    for alarm in alarms:
        print(alarm["cause"], alarm["subject"], alarm["en"]["happened"], file=sys.stderr)
    return Run(start, rest, stopped_s, unconfirmed, len(alarms))


def _move(port: int, body: int) -> None:
    """Begin to move a body; where the line was not free in time, it is asked again."""
    refusals = []
    for _ in range(TRIES):
        try:
            asked(port, post(f"/bodies/{body:02X}/moves", FAR))
        except RuntimeError as refusal:
            refusals.append(str(refusal))
        else:
            return
    raise RuntimeError(f"not measured, because body {body:02X} did not begin to move: {refusals}")


def _most_percent(port: int, seconds: float) -> float:
    """The highest share of the line that health has had in any ten seconds."""
    ends_at, most = monotonic() + seconds, 0.0
    while monotonic() < ends_at:
        sleep(1.0)
        most = max(most, asked(port, get("/lines/line"))["load"].get("health", 0.0))
    return most


@contextmanager
def busy(loops: int) -> Iterator[None]:
    """Load the machine."""
    running = [subprocess.Popen([sys.executable, "-c", SPIN]) for _ in range(loops)]
    try:
        yield
    finally:
        for program in running:
            program.kill()
            program.wait()


@asynccontextmanager
async def _line(setting: Setting) -> AsyncIterator[int]:
    """Run the gateway on a paced line, on whatever processor is free; give its port."""
    web = free_port()
    async with AsyncExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        path = folder / "line"
        await stack.enter_async_context(simulated_line(BODIES, "--pty", str(path), "--baud", str(BAUD)))
        config = write_config(folder, web, 0, BODIES, keys=setting.keys)
        text = config.read_text().replace("tcp://127.0.0.1:0", f"serial://{path}?baud={BAUD}")
        config.write_text(text + setting.tables)
        await stack.enter_async_context(gateway(config, web, os.sched_getaffinity(0)))
        yield web
