"""What it costs the gateway to tell one client where 120 bodies stand, five times a second."""

import asyncio
from asyncio.subprocess import Process
from contextlib import AsyncExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.figures import Figure, Target
from benchmarks.http_read import write_config
from benchmarks.processes import cpu_s, free_port, gateway, set_apart, simulated_line
from benchmarks.subscribers import Subscriber

BODIES = list(range(120))
SAMPLE = 5
ROUNDS = 5
SETTLE_S = 3.0
"""All bodies are known then, and the groups for sweeps are defined."""
GROUPS = 'sweep_groups = ["90", "9E"]\n'
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
    """Percent of a processor while nobody watches and while somebody does, and the values a second."""
    line, web = free_port(), free_port()
    async with AsyncExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        apart = stack.enter_context(set_apart())
        await stack.enter_async_context(simulated_line(BODIES, "--listen", f"tcp://127.0.0.1:{line}"))
        config = write_config(folder, web, line, BODIES)
        config.write_text(config.read_text().replace("[[lines.bodies]]", f"{GROUPS}[[lines.bodies]]", 1))
        process = await stack.enter_async_context(gateway(config, web, apart))
        await asyncio.sleep(SETTLE_S)
        return [
            (await percent(process, seconds), *await _watched(process, web, seconds)) for _ in range(ROUNDS)
        ]


async def _watched(process: Process, port: int, seconds: float) -> tuple[float, float]:
    client = Subscriber(TARGET)
    await asyncio.get_running_loop().create_connection(lambda: client, "127.0.0.1", port)
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
