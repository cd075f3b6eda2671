"""Gateways to be measured: their configuration, and one on a simulated line."""

from asyncio.subprocess import Process
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.processes import free_port, gateway, simulated_line

SWEEP_GROUPS = 'sweep_groups = ["90", "9E"]\n'


def write_config(
    folder: Path, web_port: int, line_port: int, bodies: list[int], connections: int = 1000, keys: str = ""
) -> Path:
    """Write a configuration of one line at a TCP port, with more `keys` in its table."""
    tables = "".join(f'[[lines.bodies]]\nid = "{body:02X}"\n' for body in bodies)
    line = f'[[lines]]\nid = "line"\naddress = "tcp://127.0.0.1:{line_port}"\n{keys}'
    path = folder / "gateway.toml"
    server = f"[server]\nport = {web_port}\nmax_connections = {connections}\n"
    path.write_text(f'[access]\nmode = "open"\n{server}{line}{tables}')
    return path


@asynccontextmanager
async def gateway_on_line(
    bodies: list[int], apart: set[int], keys: str = ""
) -> AsyncIterator[tuple[Process, int]]:
    """Run the gateway on a simulated line, on processors set apart; give its process and its port."""
    line, web = free_port(), free_port()
    with TemporaryDirectory() as folder:
        config = write_config(Path(folder), web, line, bodies, keys=keys)
        async with (
            simulated_line(bodies, "--listen", f"tcp://127.0.0.1:{line}"),
            gateway(config, web, apart) as process,
        ):
            yield process, web
