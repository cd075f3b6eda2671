"""A client of live values that takes everything at once."""

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from typing import Any

from gateway.core.events import Event, EventHub, Writer


class Watcher:
    """An outlet, and what was written to it at once."""

    def __init__(self) -> None:
        self.takes = True
        self.on_room: Callable[[], None] = lambda: None
        self.writer: Writer = _lines
        self.writes: list[list[dict[str, Any]]] = []

    def write(self, batch: bytes) -> None:
        self.writes.append([json.loads(line) for line in batch.splitlines()])

    def of(self, type_: str = "body.position", subject: str = "/bodies/line1.3F") -> list[dict[str, Any]]:
        """The events of a type about a subject."""
        return [
            event
            for write in self.writes
            for event in write
            if (event["type"], event["subject"]) == (type_, subject)
        ]

    @property
    def pulses(self) -> list[list[int]]:
        """The positions of each write."""
        return [[event["data"]["pulses"] for event in write] for write in self.writes]


def _lines(events: Sequence[Event]) -> bytes:
    return "\n".join(event.json for event in events).encode()


@asynccontextmanager
async def watching(hub: EventHub, **options: Any) -> AsyncIterator[Watcher]:
    """Subscribe, and leave at the end."""
    watcher = Watcher()
    task = asyncio.create_task(hub.subscribe(**options).deliver(watcher))
    await asyncio.sleep(0)
    try:
        yield watcher
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
