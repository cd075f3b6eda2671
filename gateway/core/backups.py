"""Backups that are read from controllers, one after the other: minutes of work, followed and cancelled."""

import asyncio
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from typing import Protocol

from gateway.core.backup_record import Backup, BackupError, Status
from gateway.core.errors import BodyBusy, Cancelled, GatewayError, NotFound, ShuttingDown
from gateway.core.move_log import new_id

HISTORY = 10
PROGRESS_S = 1.0
"""Progress is told at most this often."""


class Progress(Protocol):
    """Who is told how far a reading has come."""

    def expect(self, answers: int | None, /) -> None:
        """So many more answers are wanted at most; None where nobody knows."""

    def has_read(self) -> None:
        """One more answer was read."""


class Source(Protocol):
    """A controller that is read."""

    @property
    def address(self) -> str:
        """Its unique address."""

    async def require_ready(self) -> None:
        """Make sure that it answers, and is not being changed as a whole.

        :raises GatewayError: it does not, or it is.
        """

    async def read(self, progress: Progress, /) -> str:
        """Read all that it keeps, as text.

        :raises GatewayError: it was not read.
        """


@dataclass(eq=False)
class _Reading:
    """A backup that is being read."""

    record: Backup
    publish: Callable[[str, Backup], None]
    told_at: float = field(default_factory=lambda: asyncio.get_running_loop().time())

    def expect(self, answers: int | None) -> None:
        known = self.record.expected
        self.record.expected = None if answers is None or known is None else known + answers

    def has_read(self) -> None:
        self.record.read += 1
        now = asyncio.get_running_loop().time()
        if now - self.told_at >= PROGRESS_S:
            self.told_at = now
            self.publish("progress", self.record)


class Backups:
    """The backups of a plant, one at a time of each target."""

    def __init__(self, publish: Callable[[str, Backup], None]) -> None:
        self._publish: Callable[[str, Backup], None] = lambda what, record: publish(what, _short(record))
        self._records: OrderedDict[str, Backup] = OrderedDict()
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self._closed = False

    async def start(self, target: str, preamble: str, sources: Sequence[Source]) -> Backup:
        """Begin to read controllers, one after the other.

        :raises BodyBusy: a backup of the same is being read.
        :raises GatewayError: one of them does not answer, or is being changed.
        """
        self._require_none(target)
        for source in sources:
            await source.require_ready()
        self._require_none(target)
        now = datetime.now(UTC)
        addresses = [source.address for source in sources]
        record = Backup(id=new_id(now), target=target, controllers=addresses, started_at=now)
        self._records[record.id] = record
        task = asyncio.create_task(self._run(record, preamble, sources), name=f"backup {record.id}")
        self._tasks[record.id] = task
        task.add_done_callback(partial(self._ended, record))
        self._forget_oldest()
        self._publish("started", record)
        return record

    def _require_none(self, target: str) -> None:
        if any(it.target == target and it.id in self._tasks for it in self._records.values()):
            raise BodyBusy(
                f"A backup of {target} is being read; nothing was sent.", "Wait for its end or cancel it."
            )

    def get(self, target: str, backup_id: str) -> Backup:
        """Find a backup; `current` is the one under way, or the last.

        :raises NotFound: there is none, or it is no longer kept.
        """
        newest = (it for it in reversed(self._records.values()) if it.target == target)
        found = next((it for it in newest if backup_id in ("current", it.id)), None)
        if found is None:
            raise NotFound(f"{target} has no backup {backup_id}.")
        return found

    async def wait(self, backup: Backup, timeout_s: float) -> None:
        """Wait until a backup is read, or the time is up."""
        if timeout_s > 0 and (task := self._tasks.get(backup.id)) is not None:
            await asyncio.wait([task], timeout=timeout_s)

    async def cancel(self, target: str) -> Backup:
        """Read no more, and give the record.

        :raises NotFound: none is under way.
        """
        running = (it for it in self._records.values() if it.target == target and it.id in self._tasks)
        record = next(running, None)
        if record is None:
            raise NotFound(f"No backup of {target} is being read.")
        task = self._tasks[record.id]
        task.cancel()
        await asyncio.wait([task])
        return record

    async def close(self) -> None:
        """Break off those that are being read."""
        self._closed = True
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _forget_oldest(self) -> None:
        over = [backup_id for backup_id in self._records if backup_id not in self._tasks]
        for backup_id in over[: max(len(self._records) - HISTORY, 0)]:
            del self._records[backup_id]

    async def _run(self, record: Backup, preamble: str, sources: Sequence[Source]) -> None:
        reading = _Reading(record, self._publish)
        text = preamble
        try:
            for source in sources:
                record.controller = source.address
                text += await source.read(reading)
        except GatewayError as error:
            self._end(record, "failed", error)
        else:
            record.text = text
            self._end(record, "succeeded", None)

    def _ended(self, record: Backup, task: "asyncio.Task[None]") -> None:
        """Forget the work, which may have been cancelled before it had begun."""
        del self._tasks[record.id]
        if task.cancelled():
            unwanted = Cancelled("The backup was cancelled by request; nothing was changed.", "Begin anew.")
            self._end(record, "cancelled", ShuttingDown() if self._closed else unwanted)

    def _end(self, record: Backup, status: Status, error: GatewayError | None) -> None:
        record.status, record.ended_at = status, datetime.now(UTC)
        record.error = None if error is None else BackupError.of(error)
        self._publish(status, record)


def _short(record: Backup) -> Backup:
    """A record as an event tells it."""
    return record.model_copy(update={"text": None})
