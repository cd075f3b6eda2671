"""The time of a stop from its client's socket to the line, while other clients ask for all they can.

The yardstick is the same gateway, its event ring as full, with no other client but one that reads.
"""

import asyncio
import re
from asyncio.subprocess import Process
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from math import ceil
from pathlib import Path
from socket import socket
from tempfile import TemporaryDirectory
from time import monotonic, sleep

from benchmarks.figures import Figure, Target
from benchmarks.first_byte import Overheard
from benchmarks.gateways import write_config
from benchmarks.http_client import Door, ask, connect, get, post
from benchmarks.processes import announced, free_port, module, set_apart
from gateway.core.events import RETAINED_EVENTS
from protocols.rorze.link import CR
from protocols.rorze.stops import StopImmediately
from simulator.ports import serve_tcp
from simulator.rorze.line import build_line

BODIES = list(range(8))
MOVERS = BODIES[:6]
"""Bodies that are moved and stopped; the others are read."""
HOSTILE = ("documents", "commands", "metrics", "giant-heads", "slow-heads")
FILL_S = 240.0
"""Seconds after which an event ring that is not full never will be."""
RECHECK_S = 0.1
QUIET_SHARE = 0.25
"""Share of the seconds in which no other client asks."""
LEAST_STOPS = 3
P999_MS = 20.0
MAX_MS = 50.0

SPEEDS = {
    "set-start-speed": {"speed": 5_000},
    "set-maximum-speed": {"speed": 50_000},
    "set-maximum-acceleration": {"acceleration": 100_000},
}
FAR = {"kind": "relative", "direction": "cw", "distance": {"value": 900_000, "unit": "pulse"}}
STOP = {"mode": "immediate"}
STOP_CODE = StopImmediately.code.encode()
_EVENTS = re.compile(rb"^motion_gateway_events_total (\S+)", re.MULTILINE)


class Line(Overheard):
    """A machine that notes when the immediate stop of each body begins to arrive for the first time."""

    _begun = b""

    def receive(self, data: bytes, now: float) -> None:
        """Note the time, and let the machine work."""
        *frames, self._begun = (self._begun + data).split(CR)
        for frame in frames:
            if frame.endswith(STOP_CODE):
                self.heard.setdefault(frame, monotonic())
        self._machine.receive(data, now)


async def run(seconds: float) -> list[Figure]:
    """Stop moving bodies again and again, first among friends and then among others."""
    async with full_gateway() as (line, port, _), clients(port, "reads"):
        quiet = await stops_ms(line, Door(port), QUIET_SHARE * seconds)
        async with clients(port, *HOSTILE):
            loud = await stops_ms(line, Door(port), (1 - QUIET_SHARE) * seconds)
    name = "stop among hostile clients"
    return [
        quantile_ms(f"{name}: p99.9", 0.999, loud, quiet, P999_MS),
        quantile_ms(f"{name}: max", 1.0, loud, quiet, MAX_MS),
    ]


def quantile_ms(
    name: str, share: float, measured: list[float], yardstick: list[float], at_most: float
) -> Figure:
    """The least milliseconds that a share of the measurements does not exceed."""
    ours, theirs = _quantile(measured, share), _quantile(yardstick, share)
    return Figure(name, f"ms of {len(measured)}", [ours], [theirs], Target("figure", "<=", at_most))


def _quantile(values: list[float], share: float) -> float:
    return sorted(values)[ceil(share * len(values)) - 1]


@asynccontextmanager
async def full_gateway(
    connections: int = 1000, program: str = "benchmarks.full_ring"
) -> AsyncIterator[tuple[Line, int, Process]]:
    """Run the gateway, its event ring full, on a line in this process; give the line, port and process."""
    line = Line(build_line(BODIES, monotonic()))
    web = free_port()
    async with AsyncExitStack() as stack:
        port = await serve_tcp(line, "127.0.0.1", 0)
        stack.push_async_callback(port.aclose)
        folder = Path(stack.enter_context(TemporaryDirectory()))
        config = write_config(folder, web, int(port.address.rpartition(":")[2]), BODIES, connections)
        apart = stack.enter_context(set_apart())
        serving = module(program, web, str(config), processors=apart)
        process = await stack.enter_async_context(serving)
        await asyncio.to_thread(teach_speeds, Door(web), MOVERS)
        await asyncio.to_thread(_wait_until_full, web)
        yield line, web, process


@asynccontextmanager
async def clients(port: int, *kinds: str) -> AsyncIterator[None]:
    """Let clients of these kinds ask flat out, each kind one."""
    async with announced("-m", "benchmarks.hostile", str(port), *kinds):
        yield


def teach_speeds(door: Door, bodies: list[int]) -> None:
    """Let bodies know how fast they move."""
    with door.connect() as sock:
        for body in bodies:
            for name, value in SPEEDS.items():
                ask(sock, door.signed(post(f"/bodies/{body:02X}/commands/{name}", value)))


def _wait_until_full(port: int) -> None:
    give_up_at = monotonic() + FILL_S
    with connect(port) as sock:
        while monotonic() < give_up_at:
            found = _EVENTS.search(ask(sock, get("/metrics")))
            if found and float(found[1]) >= RETAINED_EVENTS:
                return
            sleep(RECHECK_S)
    raise RuntimeError(f"not measured, because the event ring was not full after {FILL_S:g} s")


async def stops_ms(line: Line, door: Door, seconds: float) -> list[float]:
    """Move and stop all movers for some seconds; the milliseconds until each stop began to arrive."""
    ends_at = monotonic() + seconds
    taken = await asyncio.gather(*(_stop_one(line, door, body, ends_at) for body in MOVERS))
    return [milliseconds for some in taken for milliseconds in some]


async def _stop_one(line: Line, door: Door, body: int, ends_at: float) -> list[float]:
    taken: list[float] = []
    frame = b"&%02X" % body + STOP_CODE
    place = f"/bodies/{body:02X}"
    move, stop = (
        door.signed(request) for request in (post(f"{place}/moves", FAR), post(f"{place}/stop", STOP))
    )
    with door.connect() as sock:
        while monotonic() < ends_at or len(taken) < LEAST_STOPS:
            with suppress(RuntimeError):  # it still has the last one: a stop is measured all the same
                await asyncio.to_thread(ask, sock, move)
            line.heard.pop(frame, None)
            sent_at = await asyncio.to_thread(_ask, sock, stop)
            async with asyncio.timeout(FILL_S):
                while frame not in line.heard:  # noqa: ASYNC110  # answered before it was sent
                    await asyncio.sleep(0.001)
            taken.append(1000 * (line.heard[frame] - sent_at))
    return taken


def _ask(sock: socket, request: bytes) -> float:
    """Ask, and tell when the request was about to be written."""
    sent_at = monotonic()
    ask(sock, request)
    return sent_at
