"""The processor time of checking a key, at each read of a value that the gateway knows already.

The yardstick is the same gateway without access control.
"""

from asyncio.subprocess import Process
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.figures import Figure, Target
from benchmarks.gateways import write_config
from benchmarks.http_client import get
from benchmarks.http_cost import read_us
from benchmarks.processes import free_port, gateway, set_apart, simulated_line
from gateway.access.keys import KeyStore
from gateway.access.roles import Role

BODIES = list(range(8))
ROUNDS = 7
READ = get("/bodies/00")
AT_MOST = Target("ratio", "<=", 1.10)


async def run(seconds: float) -> list[Figure]:
    """Read from both gateways in turn."""
    share = seconds / ROUNDS / 4
    with set_apart() as apart:
        async with _gateway(apart, "") as open_one, _gateway(apart, "line") as guarded:
            taken = [
                [await read_us(*server, share) for server in (guarded, open_one)] for _ in range(ROUNDS + 1)
            ]
    measured, yardstick = zip(*taken[1:], strict=True)  # in the first round caches fill
    return [Figure("read with a checked key: processor", "us", measured, yardstick, AT_MOST)]


@asynccontextmanager
async def _gateway(apart: set[int], scope: str) -> AsyncIterator[tuple[Process, int, bytes]]:
    """Run a gateway on a simulated line, with a key for this scope if there is one; give the read."""
    line, web = free_port(), free_port()
    async with AsyncExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        config = write_config(folder, web, line, BODIES)
        request = READ
        if scope:
            text = config.read_text().replace('mode = "open"', "requests_per_key = 1000")
            config.write_text(text)
            token = KeyStore(config.with_suffix(".data")).create("reader", Role.VIEWER, [scope])
            request = READ.replace(b"\r\n\r\n", f"\r\nAuthorization: Bearer {token}\r\n\r\n".encode())
        start = stack.enter_async_context
        await start(simulated_line(BODIES, "--listen", f"tcp://127.0.0.1:{line}"))
        process = await start(gateway(config, web, apart))
        yield process, web, request
