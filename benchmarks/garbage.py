"""The hold of the event loop by collections of garbage, in a gateway that moves all its bodies."""

import asyncio
from contextlib import ExitStack
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from benchmarks.fan_out import BODIES, moves_per_s
from benchmarks.figures import Figure, Target
from benchmarks.gateways import write_config
from benchmarks.http_client import Door
from benchmarks.processes import free_port, module, set_apart, simulated_line
from benchmarks.stop_latency import teach_speeds

LONGEST_MS = 5.0


async def run(seconds: float) -> list[Figure]:
    """Move flat out; the longest collection beside the usual one, in processor time."""
    pauses = await _pauses_ms(seconds)
    usual = median(pauses)
    return [
        Figure(
            "longest collection under moves", "ms", [max(pauses)], [usual], Target("figure", "<=", LONGEST_MS)
        ),
    ]


async def _pauses_ms(seconds: float) -> list[float]:
    web, line = free_port(), free_port()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        apart = stack.enter_context(set_apart())
        config = write_config(folder, web, line, BODIES)
        async with (
            simulated_line(BODIES, "--listen", f"tcp://127.0.0.1:{line}"),
            module("benchmarks.watched_collections", web, str(config), processors=apart) as process,
        ):
            assert process.stdout is not None
            reading = asyncio.create_task(process.stdout.read())
            await asyncio.to_thread(teach_speeds, Door(web), BODIES)
            await moves_per_s(web, seconds)
            process.terminate()
            return [float(number) for number in (await reading).split()]
