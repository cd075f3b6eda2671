"""The processor time of telling one client the positions of 120 bodies, five times a second."""

import asyncio
from asyncio.subprocess import Process

from benchmarks.figures import Figure, Target
from benchmarks.gateways import SWEEP_GROUPS, gateway_on_line
from benchmarks.http_client import open_for
from benchmarks.processes import cpu_s, set_apart
from benchmarks.subscribers import Subscriber

BODIES = list(range(120))
SAMPLE = 5
ROUNDS = 5
SETTLE_S = 3.0
"""All bodies are known then, and the groups for sweeps are defined."""
TARGET = f"/events?types=body.position&sample={SAMPLE}"


async def run(seconds: float) -> list[Figure]:
    """Watch, and watch nothing, in turn."""
    rounds = await _rounds(seconds / ROUNDS / 2)
    idle, watched, values = (list(figures) for figures in zip(*rounds, strict=True))
    wanted = [float(len(BODIES) * SAMPLE)] * ROUNDS
    return [
        Figure("120 bodies watched: a processor", "%", watched, idle, Target("figure", "<=", 10.0)),
        Figure("120 bodies watched: values", "a s", values, wanted, Target("ratio", ">=", 0.8)),
    ]


async def _rounds(seconds: float) -> list[tuple[float, float, float]]:
    """Percent of a processor without a client and with one, and the values a second that it gets."""
    with set_apart() as apart:
        async with gateway_on_line(BODIES, apart, SWEEP_GROUPS) as (process, web):
            await asyncio.sleep(SETTLE_S)
            return [
                (await percent(process, seconds), *await _watched(process, web, seconds))
                for _ in range(ROUNDS)
            ]


async def _watched(process: Process, port: int, seconds: float) -> tuple[float, float]:
    client = Subscriber(TARGET)
    await open_for(client, port)
    await client.open.wait()
    before = client.values
    cpu = await percent(process, seconds)
    values = client.values - before
    client.leave()
    return cpu, values / seconds


async def percent(process: Process, seconds: float) -> float:
    """Give the share of a processor that a program takes in the next seconds."""
    begun_s = cpu_s(process)
    await asyncio.sleep(seconds)
    return 100 * (cpu_s(process) - begun_s) / seconds
