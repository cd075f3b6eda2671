"""The processor time of requests, beside that of a bare FastAPI application.

Processor time, unlike a rate, does not depend on the machine's other work.
"""

import asyncio
from asyncio.subprocess import Process
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from benchmarks.fan_out import MOVE
from benchmarks.figures import Figure, Target
from benchmarks.gateways import gateway_on_line
from benchmarks.http_client import Door, ask, connect, get, latencies, post, requests_per_s
from benchmarks.http_read import CLIENTS
from benchmarks.processes import cpu_s, free_port, module, set_apart
from benchmarks.stop_latency import teach_speeds
from protocols.rorze.row import LAST_BODY

BODIES = list(range(8))
FULL = list(range(LAST_BODY + 1))
ROUNDS = 5
HELLO = get("/hello")
COMMANDS = [post(f"/bodies/{body:02X}/commands/set-homing-retries", {"retries": 1}) for body in BODIES]
KEPT = [post(f"/bodies/{body:02X}/kept/set-homing-retries", {"retries": 1}) for body in BODIES]
"""The yardstick writes these to the disk first, and asks a fence before each, as the gateway has to."""
OF_A_HELLO = Target("ratio", "<=", 1.0)
OF_A_HOP = Target("ratio", "<=", 1 / 0.85)
OF_A_KEPT_HOP = Target("ratio", "<=", 1 / 0.9)
SHARES = 17
"""Parts that a round has."""

Server = tuple[Process, int]


async def run(seconds: float) -> list[Figure]:
    """Ask gateway and yardstick in turn, each for a part of the seconds."""
    share = seconds / ROUNDS / SHARES
    async with _servers() as (ours, full, bare):
        reads = {
            "GET /bodies/{body_id}": get("/bodies/00"),
            "GET /lines": get("/lines"),
            "GET /moves/{move_id}": get(await asyncio.to_thread(_moved, ours[1])),
        }
        rounds = [await _round(ours, full, bare, reads, share) for _ in range(ROUNDS + 1)]
    hello, many, hop, kept_hop, command, *taken = zip(*rounds[1:], strict=True)  # caches fill in the first
    return [
        *(
            Figure(f"{name}: processor", "us", rounds, hello, OF_A_HELLO)
            for name, rounds in zip(reads, taken, strict=True)
        ),
        Figure("GET /bodies of 120: processor", "us", many, hello, Target("figure", "<=", 2000.0)),
        Figure(f"POST commands, {CLIENTS} clients: processor", "us", command, hop, OF_A_HOP),
        Figure("the same beside a hop with disk and fence", "us", command, kept_hop, OF_A_KEPT_HOP),
    ]


async def _round(
    ours: Server, full: Server, bare: Server, reads: dict[str, bytes], share: float
) -> list[float]:
    return [
        await read_us(*bare, HELLO, share),
        await read_us(*full, get("/bodies"), share),
        await _commands_us(*bare, COMMANDS, share),
        await _commands_us(*bare, KEPT, share),
        await _commands_us(*ours, COMMANDS, share),
        *[await read_us(*ours, request, share) for request in reads.values()],
    ]


async def read_us(process: Process, port: int, request: bytes, seconds: float) -> float:
    """The processor time of a read, without what the server does anyway."""
    idle_s = await _idle_s(process, seconds)
    begun_s = cpu_s(process)
    reads = len(await asyncio.to_thread(latencies, port, [request], seconds))
    return 1e6 * (cpu_s(process) - begun_s - idle_s) / reads


async def _commands_us(process: Process, port: int, commands: list[bytes], seconds: float) -> float:
    idle_s = await _idle_s(process, seconds)
    begun_s, begun_at = cpu_s(process), asyncio.get_running_loop().time()
    rate = await requests_per_s(port, CLIENTS, commands, seconds)
    took_s = asyncio.get_running_loop().time() - begun_at
    return 1e6 * (cpu_s(process) - begun_s - idle_s * took_s / seconds) / (rate * took_s)


async def _idle_s(process: Process, seconds: float) -> float:
    begun_s = cpu_s(process)
    await asyncio.sleep(seconds)
    return cpu_s(process) - begun_s


def _moved(port: int) -> str:
    """Move a body, and tell where its move is found again."""
    teach_speeds(Door(port), BODIES[:1])
    with connect(port) as sock:
        head = ask(sock, post("/bodies/00/moves?wait=10", MOVE)).partition(b"\r\n\r\n")[0].decode()
    return next(line.partition(": ")[2] for line in head.split("\r\n") if line.startswith("location"))


@asynccontextmanager
async def _servers() -> AsyncIterator[tuple[Server, Server, Server]]:
    """Run the gateway on a line of some bodies and on a full one, and the bare application on its echo."""
    echo, bare = free_port(), free_port()
    with set_apart() as apart:
        async with (
            gateway_on_line(BODIES, apart) as ours,
            gateway_on_line(FULL, apart) as full,
            module("benchmarks.echo", echo),
            module("benchmarks.bare_app", bare, str(echo), processors=apart) as bare_app,
        ):
            yield ours, full, (bare_app, bare)
