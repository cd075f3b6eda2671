"""Backups that are read from controllers, one after the other: minutes of work, followed and cancelled."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from math import inf
from typing import Protocol

from gateway.core.backup_record import Backup, BackupError, Status
from gateway.core.errors import BodyBusy, Cancelled, GatewayError, NotFound, ShuttingDown
from gateway.core.move_log import new_id
from gateway.core.works import Works

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


class Backups(Works[Backup]):
    """The backups of a plant, one at a time of each target."""

    def __init__(self, publish: Callable[[str, Backup], None]) -> None:
        super().__init__(HISTORY, "backup", lambda it: it.target)
        self._publish: Callable[[str, Backup], None] = lambda what, record: publish(what, _short(record))
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
        task = self.begin(record, self._run(record, preamble, sources), "backup")
        task.add_done_callback(partial(self._ended, record))
        self._publish("started", record)
        return record

    def _require_none(self, target: str) -> None:
        if self._current(target) is not None:
            raise BodyBusy(
                f"A backup of {target} is being read; nothing was sent.", "Wait for its end or cancel it."
            )

    async def cancel(self, target: str) -> Backup:
        """Read no more, and give the record.

        :raises NotFound: none is under way.
        """
        record = self._current(target)
        if record is None:
            raise NotFound(f"No backup of {target} is being read.")
        self.break_off(record)
        await self.wait(record, inf)
        return record

    def _current(self, target: str) -> Backup | None:
        return next((it for it in self.under_way() if it.target == target), None)

    async def close(self) -> None:
        """Break off those that are being read."""
        self._closed = True
        await super().close()

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
        """Note the end of what was cancelled, maybe before it had begun."""
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
