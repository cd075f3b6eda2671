"""A gateway that tells how long collections take: `python -m benchmarks.watched_collections PORT CONFIG`.

At its end it prints the milliseconds of processor time of each that came after the start.
"""

import gc
import sys
from pathlib import Path
from time import thread_time

import uvloop

from app.server import serve
from gateway.config import load


class Clock:
    """Notes how long collections take, from when the gateway runs."""

    def __init__(self) -> None:
        self.pauses_ms: list[float] = []
        self._begun_at = 0.0

    def note(self, phase: str, _info: dict[str, int]) -> None:
        """A collection begins, or has ended."""
        if phase == "start":
            self._begun_at = thread_time()
        elif gc.isenabled():
            self.pauses_ms.append(1000 * (thread_time() - self._begun_at))


def main(config: Path) -> None:
    """Serve until the process is ended, then tell."""
    clock = Clock()
    gc.disable()  # as the command line does
    gc.callbacks.append(clock.note)
    uvloop.run(serve(load(config), config.with_suffix(".data")))
    gc.callbacks.clear()
    print(*clock.pauses_ms)


if __name__ == "__main__":
    main(Path(sys.argv[2]))
