"""The time of a start until `/readyz` says that the line can be used, and the memory used then."""

import asyncio
import resource
import subprocess
import sys

from benchmarks.figures import Figure, Target
from benchmarks.gateways import gateway_on_line
from benchmarks.http_client import connect, get
from benchmarks.processes import cpu_s, resident_mib, set_apart

BODIES = list(range(17))
ROUNDS = 5
IMPORT = [sys.executable, "-c", "import fastapi"]


async def run(_seconds: float) -> list[Figure]:
    """Start the gateway several times, each time beside a program that does nothing but import FastAPI."""
    took, importing, mib = zip(*[await _round() for _ in range(ROUNDS + 1)], strict=True)
    return [
        # 1.2 s where the import takes 0.25 s, as on two quiet cores.
        Figure("start to /readyz: processor", "s", took[1:], importing[1:], Target("ratio", "<=", 4.0)),
        Figure("memory when ready", "MiB", mib[1:], [0.0] * ROUNDS, Target("figure", "<=", 100.0)),
    ]


async def _round() -> tuple[float, float, float]:
    begun_s = _children_s()
    await asyncio.to_thread(subprocess.run, IMPORT, check=True)
    importing_s = _children_s() - begun_s
    with set_apart() as apart:
        async with gateway_on_line(BODIES, apart) as (process, web):
            while not await asyncio.to_thread(_is_ready, web):  # noqa: ASYNC110  # nobody tells
                await asyncio.sleep(0.02)
            return cpu_s(process), importing_s, resident_mib(process.pid)


def _children_s() -> float:
    """Processor time of the programs that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _is_ready(port: int) -> bool:
    with connect(port) as sock:
        sock.sendall(get("/readyz"))
        return sock.recv(65_536).startswith(b"HTTP/1.1 200 ")  # before, it is 503
