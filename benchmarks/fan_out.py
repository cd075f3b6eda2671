"""The cost of events that many clients follow: of a message to one of them, and of the moves behind it.

The yardstick of a message is a bare broadcast of the same frames in the same process; that of the moves is
the same gateway without followers.
"""

import asyncio
from asyncio.subprocess import Process
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.figures import Figure, Target
from benchmarks.gateways import gateway_on_line, write_config
from benchmarks.http_client import Door, is_complete, post
from benchmarks.processes import announced, free_port, module, set_apart
from benchmarks.stop_latency import teach_speeds

SUBSCRIBERS = 100
BODIES = list(range(17))
ROUNDS = 5
MOVE = {"kind": "relative", "direction": "cw", "distance": {"value": 1, "unit": "pulse"}}
MOVES = [post(f"/bodies/{body:02X}/moves?wait=10", MOVE) for body in BODIES]


async def run(seconds: float) -> list[Figure]:
    """Measure both, each with its yardstick in turn."""
    share = seconds / ROUNDS / 4
    ours, bare = zip(*await _us_a_message(share), strict=True)
    followed, alone = zip(*await _moves_per_s(share), strict=True)
    to = f"{SUBSCRIBERS} subscribers"
    return [
        Figure(f"event to {to}: a message", "us", ours, bare, Target("figure", "<=", 12.0)),
        Figure(f"moves with {to}", "moves/s", followed, alone, Target("ratio", ">=", 0.5)),
    ]


async def _us_a_message(seconds: float) -> list[tuple[float, float]]:
    web, bare, line = free_port(), free_port(), free_port()
    async with AsyncExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        config = write_config(folder, web, line, BODIES)
        apart = stack.enter_context(set_apart())
        arguments = (str(config), str(bare), str(SUBSCRIBERS), str(seconds))
        broadcast = module("benchmarks.broadcast", web, *arguments, processors=apart)
        process = await stack.enter_async_context(broadcast)
        assert process.stdout is not None
        for port in (web, bare):
            followers = announced("-m", "benchmarks.subscribers", str(port), str(SUBSCRIBERS), "0")
            await stack.enter_async_context(followers)
        rounds = [(await process.stdout.readline()).split() for _ in range(ROUNDS + 1)]
    return [(float(ours), float(theirs)) for ours, theirs in rounds[1:]]  # caches fill in the first


async def _moves_per_s(seconds: float) -> list[tuple[float, float]]:
    async with moved_line() as (port, _):
        await moves_per_s(port, seconds)
        return [(await _followed(port, seconds), await moves_per_s(port, seconds)) for _ in range(ROUNDS)]


async def _followed(port: int, seconds: float) -> float:
    async with announced("-m", "benchmarks.subscribers", str(port), str(SUBSCRIBERS), "0"):
        return await moves_per_s(port, seconds)


async def moves_per_s(port: int, seconds: float) -> float:
    """Move all bodies, each again as soon as it has moved."""
    loop = asyncio.get_running_loop()
    begun_at = loop.time()
    moved = await asyncio.gather(*(_move_on(port, move, begun_at + seconds) for move in MOVES))
    return sum(moved) / (loop.time() - begun_at)


async def _move_on(port: int, move: bytes, until: float) -> int:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    moved = 0
    while asyncio.get_running_loop().time() < until:
        writer.write(move)
        answer = await reader.read(65_536)
        while not is_complete(answer):
            answer += await reader.read(65_536)
        moved += 1
    writer.close()
    return moved


@asynccontextmanager
async def moved_line() -> AsyncIterator[tuple[int, Process]]:
    """Run the gateway on a simulated line whose bodies know their speeds; give its port and its process."""
    with set_apart() as apart:
        async with gateway_on_line(BODIES, apart) as (process, web):
            await asyncio.to_thread(teach_speeds, Door(web), BODIES)
            yield web, process
