"""The gateway after a day, its loop watched: `python -m benchmarks.watched_loop PORT CONFIG`.

It prints when something began that held the event loop, and for how many milliseconds of processor time.
"""

import asyncio
import sys
from pathlib import Path
from time import monotonic, thread_time

from benchmarks.full_ring import FullHub, main

BEAT_S = 0.001
LEAST_MS = 2.0


class WatchedHub(FullHub):
    """A full event hub with a task that looks at the clock whenever the loop is free."""

    def __init__(self) -> None:
        super().__init__()
        self._watching = asyncio.get_running_loop().create_task(watch())


async def watch() -> None:
    """Print each turn of the loop that was long."""
    at, used = monotonic(), thread_time()
    while True:
        await asyncio.sleep(BEAT_S)
        held_ms = 1000 * (thread_time() - used)
        if held_ms >= LEAST_MS:
            print(at, held_ms, flush=True)
        at, used = monotonic(), thread_time()


if __name__ == "__main__":
    main(Path(sys.argv[2]), WatchedHub)
