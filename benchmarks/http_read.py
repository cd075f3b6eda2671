"""The rates of HTTP reads and settings that go to controllers and back, beside a bare FastAPI application's.

That application writes a setting to the disk first, and sends a fence before it, as the gateway has to.
"""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from statistics import median

from benchmarks.figures import Figure, Target
from benchmarks.gateways import gateway_on_line
from benchmarks.http_client import get, latencies, post, requests_per_s
from benchmarks.processes import free_port, module, set_apart, simulated_line

BODIES = list(range(16))
CLIENTS = 16
ROUNDS = 5
READS = [get(f"/bodies/{body:02X}/position") for body in BODIES]
SETTINGS = [post(f"/bodies/{body:02X}/commands/set-homing-retries", {"retries": 1}) for body in BODIES]
KEPT = [post(f"/bodies/{body:02X}/kept/set-homing-retries", {"retries": 1}) for body in BODIES]


async def run(seconds: float) -> list[Figure]:
    """Load gateway and yardstick in turn, each round for a part of the seconds."""
    share = seconds / ROUNDS / 7
    p50_us: list[list[float]] = []
    rates: list[list[float]] = []
    settings: list[list[float]] = []
    async with _servers() as ports:
        for port in ports:
            await _p50_us(port, share)  # not counted: caches fill
        for _ in range(ROUNDS):
            p50_us.append([await _p50_us(port, share) for port in ports[:2]])
            rates.append([await requests_per_s(port, CLIENTS, READS, share) for port in ports])
            asked = zip(ports[::2], (SETTINGS, KEPT), strict=True)
            settings.append([await requests_per_s(port, CLIENTS, wanted, share) for port, wanted in asked])
    return [
        _figure("HTTP read, 1 client: p50", "us", p50_us, Target("ratio", "<=", 1.35)),
        _figure(
            f"HTTP read, {CLIENTS} clients",
            "req/s",
            [rate[:2] for rate in rates],
            Target("ratio", ">=", 0.65),
        ),
        _figure(
            f"HTTP read, {CLIENTS} clients: beside a bare application on such a line",
            *("req/s", [[ours, on_line] for ours, _, on_line in rates], Target("ratio", ">=", 1.15)),
        ),
        _figure(
            f"HTTP settings, {CLIENTS} clients: beside a bare application with disk and fence",
            *("req/s", settings, Target("ratio", ">=", 0.9)),
        ),
    ]


async def _p50_us(port: int, seconds: float) -> float:
    return 1e6 * median(await asyncio.to_thread(latencies, port, READS, seconds))


def _figure(name: str, unit: str, rounds: list[list[float]], target: Target) -> Figure:
    measured, yardstick = zip(*rounds, strict=True)
    return Figure(name, unit, measured, yardstick, target)


@asynccontextmanager
async def _servers() -> AsyncIterator[list[int]]:
    """Give the ports of the gateway on a simulated line, of bare applications on an echo and such a line."""
    echo, line, bare, on_line = free_port(), free_port(), free_port(), free_port()
    with set_apart() as apart:
        async with (
            gateway_on_line(BODIES, apart) as (_, web),
            module("benchmarks.echo", echo),
            module("benchmarks.bare_app", bare, str(echo), processors=apart),
            simulated_line(BODIES, "--listen", f"tcp://127.0.0.1:{line}"),
            module("benchmarks.bare_app", on_line, str(line), processors=apart),
        ):
            yield [web, bare, on_line]
