"""The cost of a move over HTTP, at first and after many moves, and the memory that moves leave."""

import asyncio
from asyncio.subprocess import Process

from benchmarks.fan_out import moved_line, moves_per_s
from benchmarks.figures import Figure, Target
from benchmarks.processes import cpu_s, resident_mib

ROUNDS = 10
MOST_IN_A_SECOND = 2000
"""Moves for each second of the measurement after which the memory is looked at: 20,000 by default."""


async def run(seconds: float) -> list[Figure]:
    """Move flat out; the later half of the rounds beside the earlier one."""
    async with moved_line() as (port, process):
        await moves_per_s(port, seconds / ROUNDS)
        before_mib = resident_mib(process.pid)
        costs = [await _cpu_ms(port, process, seconds / ROUNDS) for _ in range(ROUNDS)]
        after_mib = resident_mib(process.pid)
        many = moves = MOST_IN_A_SECOND * seconds
        while many > 0:
            many -= await _moves(port, 1.0)
        at_last_mib = resident_mib(process.pid)
    early, late = costs[: ROUNDS // 2], costs[ROUNDS // 2 :]
    return [
        Figure("move: processor time", "ms", late, early, Target("figure", "<=", 1.2)),
        Figure("memory after moves", "MiB", [after_mib], [before_mib], Target("ratio", "<=", 2.0)),
        Figure(
            f"memory after {moves:.0f} moves",
            "MiB",
            [at_last_mib],
            [before_mib],
            Target("figure", "<=", 115.0),
        ),
    ]


async def _cpu_ms(port: int, process: Process, seconds: float) -> float:
    begun_s = cpu_s(process)
    moves = await _moves(port, seconds)
    return 1000 * (cpu_s(process) - begun_s) / moves


async def _moves(port: int, seconds: float) -> float:
    """Move for a time; give how many moves that were."""
    begun_at = asyncio.get_running_loop().time()
    return await moves_per_s(port, seconds) * (asyncio.get_running_loop().time() - begun_at)
