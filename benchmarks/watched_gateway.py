"""A gateway that prints each long turn of its loop: `python -m benchmarks.watched_gateway PORT CONFIG`."""

import asyncio
import sys
from pathlib import Path

import uvloop

from app.server import serve
from benchmarks.watched_loop import watch
from gateway.config import load


async def main(config: Path) -> None:
    """Serve until the process is ended."""
    watching = asyncio.create_task(watch())
    try:
        await serve(load(config), config.with_suffix(".data"))
    finally:
        watching.cancel()


if __name__ == "__main__":
    uvloop.run(main(Path(sys.argv[2])))
