"""A simulator behind a pseudo-terminal, in a thread of its own: what a command finds at a real port."""

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread
from time import monotonic

from simulator.ports import Machine, Port, serve_pty


@contextmanager
def behind_a_terminal(make: Callable[[float], Machine], link: Path) -> Iterator[None]:
    """Serve a machine at a link until the block ends."""
    loop = asyncio.new_event_loop()

    async def serve() -> Port:
        return serve_pty(make(monotonic()), link)

    thread = Thread(target=loop.run_forever, daemon=True)
    thread.start()
    port = asyncio.run_coroutine_threadsafe(serve(), loop).result(10)
    try:
        yield
    finally:
        asyncio.run_coroutine_threadsafe(port.aclose(), loop).result(10)
        loop.call_soon_threadsafe(loop.stop)
        thread.join(10)
        loop.close()
