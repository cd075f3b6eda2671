"""A journal on a disk that forgets what was not synced when the power is cut, in virtual time."""

import asyncio
import sqlite3
from collections.abc import Callable, Sequence
from copy import copy
from queue import SimpleQueue
from random import Random
from typing import Any

from gateway.core.journal.disk import Disk, DiskFailed, NotWritable
from gateway.core.journal.journal import CHECK_S, Journal
from gateway.core.journal.schema import migrate
from gateway.core.journal.writes import Value, Write


class _Shared(sqlite3.Connection):
    """The database of a disk and of its copies after a kill: closed when the last of them has gone."""

    def __del__(self) -> None:
        self.close()


class ModelDisk:
    """Keeps what was committed; what only waits to be synced may be lost with the power."""

    def __init__(self, kept: Sequence[Write] = ()) -> None:
        self._connection = sqlite3.connect(":memory:", isolation_level=None, factory=_Shared)
        migrate(self._connection)
        self._durable: list[Write] = []
        self._intents: set[tuple[Value, Value]] = set()
        """The request and the frame of each that is durable."""
        self._unsynced: list[Sequence[Write]] = []
        self.full = False
        self.detached = False
        """Nothing reaches it any more: its gateway was killed."""
        self._apply(kept)
        self._sync(kept)

    def commit(self, batch: Sequence[Write], *, durable: bool) -> None:
        """Write all or nothing."""
        if self.detached:
            raise DiskFailed("it was detached")
        if self.full:
            raise NotWritable("no space left on the device")
        self._apply(batch)
        self._unsynced.append(batch)
        if durable:
            self._sync([write for waiting in self._unsynced for write in waiting])
            self._unsynced.clear()

    def _sync(self, batch: Sequence[Write]) -> None:
        self._durable += batch
        self._intents |= {
            (write.values[7], write.values[5])
            for write in batch
            if write.sql.startswith("INSERT INTO intents")
        }

    def _apply(self, batch: Sequence[Write]) -> None:
        self._connection.execute("BEGIN")
        for write in batch:
            self._connection.execute(write.sql, write.values)
        self._connection.execute("COMMIT")

    def rows(self, sql: str, values: Sequence[Value] = ()) -> list[tuple[Any, ...]]:
        """Read rows."""
        return self._connection.execute(sql, values).fetchall()

    def read_apart(self, sql: str, values: Sequence[Value] = ()) -> list[tuple[Any, ...]]:
        """Read rows; there is no other reader."""
        return self.rows(sql, values)

    def check(self) -> None:
        """It is always there."""

    def tidy(self) -> None:
        """There is nothing to be tidied."""

    def close(self) -> None:
        """Release it."""
        self.detached = True

    def after_power_cut(self, dice: Random) -> "ModelDisk":
        """The disk that is found afterwards: commits that were not synced are lost from some point on."""
        kept = self._unsynced[: dice.randint(0, len(self._unsynced))]
        return ModelDisk([*self._durable, *(write for batch in kept for write in batch)])

    def after_kill(self) -> "ModelDisk":
        """The disk that is found when only the process was killed: every commit is there."""
        found = copy(self)
        found._intents, found._durable, found._unsynced = {*self._intents}, [*self._durable], []
        found._sync([write for batch in self._unsynced for write in batch])
        found.full = found.detached = False
        return found

    def has_intent(self, request_id: str | None, frame: str) -> bool:
        """Say whether a loss of power now would leave the intent to write a frame for a request."""
        return (request_id, frame) in self._intents


class _Waking(SimpleQueue[Any]):
    """Wakes the writer."""

    def __init__(self) -> None:
        super().__init__()
        self.filled = asyncio.Event()

    def put(self, item: Any, block: bool = True, timeout: float | None = None) -> None:
        super().put(item, block, timeout)
        self.filled.set()


class VirtualJournal(Journal):
    """The journal with a task in the place of its thread: each commit takes as long as the dice say."""

    def __init__(self, disk: Disk, *, ran_s: float, takes_s: Callable[[], float]) -> None:
        super().__init__(disk, ran_s=ran_s)
        self.takes_s = takes_s
        self.writer.waiting = self._waking = _Waking()
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin to write."""
        self._loop = asyncio.get_running_loop()
        self.writer.settle = self._settle_soon
        self._task = asyncio.create_task(self._write_on(), name="journal")

    async def _write_on(self) -> None:
        while True:
            try:
                async with asyncio.timeout(CHECK_S):
                    await self._waking.filled.wait()
            except TimeoutError:
                self.writer.look()
                continue
            await asyncio.sleep(self.takes_s())
            self._waking.filled.clear()
            while not self._waking.empty():
                if not self.writer.write(self.writer.take()):
                    return

    def kill(self) -> None:
        """Write nothing more: what waited is lost with the process."""
        self.disk.close()
        if self._task is not None:
            self._task.cancel()
            self._task = None

    async def close(self) -> None:
        """End well, unless it was killed."""
        if self._task is not None:
            self.on_trouble = lambda _why: None
            self._put(None)
            await self._task
            self.disk.close()
