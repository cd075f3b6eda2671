"""Heartbeats beside a program without asyncio, as a thread; `async_heart` is the same as a task."""

import threading
from collections.abc import Callable
from types import TracebackType
from typing import Self


class Heart:
    """Calls something again and again while the block runs; ends when that gives False."""

    def __init__(self, every_s: float, beat: Callable[[], bool]) -> None:
        self._every_s, self._beat = every_s, beat
        self._enough = threading.Event()
        self._thread = threading.Thread(target=self._run, name="heartbeat", daemon=True)

    def __enter__(self) -> Self:
        """Begin to beat."""
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: object, trace: TracebackType | None) -> None:
        """End it, and wait for the last beat's end."""
        self._enough.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._enough.wait(self._every_s) and self._beat():
            continue
