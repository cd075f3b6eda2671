"""A machine that says what it hears, behind a dual-port RAM or a TCP listener: `dpram PATH` or `tcp`."""

import asyncio
import sys
from pathlib import Path

import uvloop

from benchmarks.first_byte import Echo
from simulator.fics.dpram_port import serve_dpram
from simulator.ports import Port, serve_tcp


async def serve(kind: str, path: str = "") -> None:
    """Serve until the process is ended, and say where."""
    port: Port
    port = serve_dpram(Echo(), Path(path)) if kind == "dpram" else await serve_tcp(Echo(), "127.0.0.1", 0)
    sys.stdout.write(f"{port.address}\n")
    sys.stdout.flush()
    await asyncio.Event().wait()


if __name__ == "__main__":
    uvloop.run(serve(*sys.argv[1:]))
