"""A journal on a disk that is as slow, full or broken as a story wants it, in virtual time."""

import asyncio
from collections import deque
from collections.abc import Callable, Hashable, Sequence
from typing import Any

from gateway.core.journal.journal import WRITTEN_WITHIN_S, JournalUnavailable
from gateway.core.journal.writes import Write


class ModelBook:
    """Takes a moment for each commit, in the order in which they were asked for."""

    def __init__(self, takes_s: float = 0.005) -> None:
        self.takes_s = takes_s
        self.trouble: str | None = None
        self.durable: list[tuple[float, Write]] = []
        """Writes that were waited for, and the times since which a loss of power cannot undo them."""
        self.noted: list[Write] = []
        self.waits = 0
        """Number of waits for a write."""
        self._waiting: deque[tuple[Sequence[Write], asyncio.Future[None]]] = deque()
        self._writer: asyncio.Task[None] | None = None

    def require(self) -> None:
        if self.trouble is not None:
            raise JournalUnavailable(self.trouble)

    def note(self, *entries: Write) -> None:
        self.noted += entries

    def note_newest(self, _row: Hashable, write: Callable[[], Write]) -> None:
        self.noted.append(write())

    def write(self, *entries: Write) -> asyncio.Future[None]:
        self.require()
        self.waits += 1
        loop = asyncio.get_running_loop()
        done: asyncio.Future[None] = loop.create_future()
        self._waiting.append((entries, done))
        if self._writer is None:
            self._writer = asyncio.create_task(self._commit())
        loop.call_later(WRITTEN_WITHIN_S, _give_up, done)
        return done

    async def _commit(self) -> None:
        """One commit after the other, each with all that waits."""
        while self._waiting:
            batch = list(self._waiting)
            self._waiting.clear()
            await asyncio.sleep(self.takes_s)
            now = asyncio.get_running_loop().time()
            for entries, done in batch:
                if self.trouble is not None and not done.done():
                    done.set_exception(JournalUnavailable(self.trouble))
                    continue
                self.durable += [(now, entry) for entry in entries]
                if not done.done():
                    done.set_result(None)
        self._writer = None

    # what a test sees

    def intents(self) -> list[tuple[float, dict[str, Any]]]:
        """The intents that were durable before anything was written, and since when."""
        return [(at, _named(entry)) for at, entry in self.durable if _is(entry, "INSERT INTO intents")]

    def stops(self) -> list[dict[str, Any]]:
        """Stops, written down after they were sent."""
        return [_named(entry) for entry in self.noted if _is(entry, "INSERT INTO intents")]

    def written(self) -> list[object]:
        """The intents whose first byte was handed to the port, in order."""
        return [entry.values[1] for entry in self.noted if _is(entry, "UPDATE intents SET written_at")]

    def outcomes(self) -> dict[object, object]:
        """Outcome of each intent."""
        return {entry.values[3]: entry.values[1] for entry in self.noted if "outcome" in entry.sql}


def _is(entry: Write, sql: str) -> bool:
    return entry.sql.startswith(sql)


def _named(entry: Write) -> dict[str, Any]:
    names = entry.sql.partition("(")[2].partition(")")[0].split(", ")
    return dict(zip(names, entry.values, strict=False))  # the disk itself knows how old it is


def _give_up(done: asyncio.Future[None]) -> None:
    if not done.done():
        done.set_exception(JournalUnavailable("the disk is slow"))
