"""A stop while a thousand clients follow events and half of them never read, and the memory they leave.

The yardstick is the same gateway before they come.
"""

import asyncio

from benchmarks.figures import Figure, Target
from benchmarks.http_client import Door
from benchmarks.processes import announced, resident_mib
from benchmarks.stop_latency import full_gateway, quantile_ms, stops_ms

READING = 500
SILENT = 500
CONNECTIONS = 1100
"""Theirs, and those that move and stop."""
QUIET_SHARE = 0.25
LEAVE_S = 5.0
"""Seconds after which nothing is left of a client."""


async def run(seconds: float) -> list[Figure]:
    """Stop moving bodies again and again, first alone and then among the crowd."""
    async with full_gateway(CONNECTIONS) as (line, port, process):
        quiet = await stops_ms(line, Door(port), QUIET_SHARE * seconds)
        before_mib = resident_mib(process.pid)
        async with announced("-m", "benchmarks.subscribers", str(port), str(READING), str(SILENT)):
            loud = await stops_ms(line, Door(port), (1 - QUIET_SHARE) * seconds)
            crowded_mib = resident_mib(process.pid)
        await asyncio.sleep(LEAVE_S)
        after_mib = resident_mib(process.pid)
    name = f"stop among {READING + SILENT} subscribers"
    return [
        quantile_ms(f"{name}: p50", 0.5, loud, quiet, 10.0),
        quantile_ms(f"{name}: p99", 0.99, loud, quiet, 20.0),
        Figure("memory among them", "MiB", [crowded_mib], [before_mib], Target("ratio", "<=", 2.5)),
        Figure("memory when they have left", "MiB", [after_mib], [before_mib], Target("ratio", "<=", 1.25)),
    ]
