"""A full line, 120 bodies at 9600 baud, in real time: its use at rest, reads, sweeps and stops."""

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, sleep
from typing import Any

from benchmarks.figures import Figure, Target
from benchmarks.gateways import SWEEP_GROUPS, write_config
from benchmarks.http_client import Door, ask, connect, get, latencies, post
from benchmarks.line_use import exchange_bytes
from benchmarks.processes import free_port, gateway, set_apart, simulated_line
from benchmarks.stop_latency import FAR, FILL_S, quantile_ms, teach_speeds
from gateway.core.load import WINDOW_S
from protocols.rorze.row import LAST_BODY
from transports.serial_port import BITS_PER_BYTE

BAUD = 9600
BODIES = list(range(LAST_BODY + 1))
MOVERS = BODIES[:30]
READS = [get(f"/bodies/{body:02X}/position") for body in BODIES[30:]]
ROUNDS = 5
RECHECK_S = 0.1
LOOKS_AT_LOAD = 5
QUIET_LOOKS = 20


async def run(seconds: float) -> list[Figure]:
    """Look at the line at rest, sweep it, read it while 30 motors move, and stop all of it."""
    async with _full_line() as port:
        return await asyncio.to_thread(_figures, port, seconds)


def _figures(port: int, seconds: float) -> list[Figure]:
    wait_until_at_rest(port)
    quiet_ms = [1000 * latency for latency in latencies(port, READS, seconds)]
    sleep(WINDOW_S + 1.0)
    idle = [_percent_after(port, WINDOW_S / LOOKS_AT_LOAD) for _ in range(LOOKS_AT_LOAD)]
    sweeps_s = [_sweep_s(port) for _ in range(ROUNDS)]
    teach_speeds(Door(port), MOVERS)
    with connect(port) as sock:
        for body in MOVERS:
            ask(sock, post(f"/bodies/{body:02X}/moves", FAR))
    moving_ms = [1000 * latency for latency in latencies(port, READS, seconds)]
    stop_s = _stop_s(port, asked(port, get("/bodies/00/moves?limit=1"))["moves"][0]["event_cursor"])
    one_by_one_s = len(BODIES) * exchange_bytes() * BITS_PER_BYTE / BAUD
    many = f"{len(BODIES)} bodies at {BAUD} baud"
    reads = f"{many}, {len(MOVERS)} moving: read of an idle one, p99"
    return [
        Figure(f"{many}: line use at rest", "%", idle, [100.0] * len(idle), Target("figure", "<=", 10.0)),
        quantile_ms(reads, 0.99, moving_ms, quiet_ms, 250.0),
        Figure(f"{many}: all positions", "s", sweeps_s, [one_by_one_s] * ROUNDS, Target("figure", "<=", 2.4)),
        Figure(f"{many}: all stops confirmed", "s", [stop_s], [one_by_one_s], Target("figure", "<=", 5.0)),
    ]


def wait_until_at_rest(port: int) -> None:
    """Wait until all bodies are known, and what is asked first of each has been asked."""
    give_up_at = monotonic() + FILL_S
    quiet = 0
    while quiet < QUIET_LOOKS:
        if monotonic() > give_up_at:
            raise RuntimeError(f"not measured, because the line was not at rest after {FILL_S:g} s")
        sleep(RECHECK_S)
        known = all(body["position"] is not None for body in asked(port, get("/bodies"))["bodies"])
        waiting = asked(port, get("/lines/line"))["waiting"]["background"]
        quiet = quiet + 1 if known and not waiting else 0


def _percent_after(port: int, seconds: float) -> float:
    sleep(seconds)
    return float(sum(asked(port, get("/lines/line"))["load"].values()))


def _sweep_s(port: int) -> float:
    begun_at = monotonic()
    told = asked(port, get("/lines/line/positions"))
    taken_s = monotonic() - begun_at
    if len(told["positions"]) != len(BODIES):
        raise RuntimeError(f"not measured, because some did not answer: {told['unanswered']}")
    return taken_s


def _stop_s(port: int, cursor: str) -> float:
    """Stop everything, and tell when the last body was known to stand."""
    confirmed: set[str] = set()
    begun_at = monotonic()
    asked(port, post("/stop", {"mode": "immediate"}))
    while len(confirmed) < len(BODIES):
        told = asked(port, get(f"/events?types=body.stop.confirmed&limit=1000&after={cursor}"))
        confirmed |= {event["subject"] for event in told["events"]}
        if monotonic() - begun_at > FILL_S:
            raise RuntimeError(f"not measured, because only {len(confirmed)} stops were confirmed")
        sleep(RECHECK_S / 10)
    return monotonic() - begun_at


def asked(port: int, request: bytes) -> Any:
    """Ask the gateway, and give the JSON of its answer."""
    with connect(port) as sock:
        return json.loads(ask(sock, request).partition(b"\r\n\r\n")[2])


@asynccontextmanager
async def _full_line() -> AsyncIterator[int]:
    """Run the gateway on a paced line; give its port."""
    web = free_port()
    async with AsyncExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        apart = stack.enter_context(set_apart())
        path = folder / "line"
        await stack.enter_async_context(simulated_line(BODIES, "--pty", str(path), "--baud", str(BAUD)))
        config = write_config(folder, web, 0, BODIES, keys=SWEEP_GROUPS)
        text = config.read_text().replace("tcp://127.0.0.1:0", f"serial://{path}?baud={BAUD}")
        config.write_text(text)
        await stack.enter_async_context(gateway(config, web, apart))
        yield web
