"""Long readings of controllers, one after the other: minutes of work, followed and cancelled; uploads too."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from typing import Protocol, TypeVar

from gateway.core.backup_record import BackupError, JobStatus, Reading
from gateway.core.errors import BodyBusy, Cancelled, GatewayEnding, GatewayError
from gateway.core.works import CutOff, DurableJobs, left_s

HISTORY = 10
PROGRESS_S = 1.0
"""Progress is told at most this often."""

R = TypeVar("R", bound=Reading)


class ProgressListener(Protocol):
    """A listener to the progress of a reading."""

    def expect(self, answers: int | None, /) -> None:
        """Note that up to `answers` more answers are wanted; None if unknown."""

    def has_read(self) -> None:
        """One more answer was read."""


@dataclass(eq=False)
class _Followed:
    """A reading under way."""

    record: Reading
    publish: Callable[[str], None]
    told_at: float = field(default_factory=lambda: asyncio.get_running_loop().time())
    began_at: float = field(default_factory=lambda: asyncio.get_running_loop().time())

    def expect(self, answers: int | None) -> None:
        known = self.record.expected
        self.record.expected = None if answers is None or known is None else known + answers
        self._estimate()

    def has_read(self) -> None:
        self.record.read += 1
        now = self._estimate()
        if now - self.told_at >= PROGRESS_S:
            self.told_at = now
            self.publish("progress")

    def _estimate(self) -> float:
        now, record = asyncio.get_running_loop().time(), self.record
        record.left_s = left_s(record.expected, record.read, now - self.began_at, record.baud)
        return now


class Readings(DurableJobs[R]):
    """The readings of one kind, one at a time of each target."""

    noun: str
    doing = "being read"

    def __init__(self, publish: Callable[[str, R], None]) -> None:
        super().__init__(
            HISTORY,
            self.noun,
            lambda record: record.target,
            lambda what, record: publish(what, _told(record)),
        )
        self._closed = False

    def follow(self, record: R, read: Callable[[ProgressListener], Awaitable[None]]) -> R:
        """Keep a record, and fill it by what is read."""
        followed = _Followed(record, lambda what: self.tell(what, record))
        task = self.begin(record, self._run(record, partial(read, followed)), self.noun)
        task.add_done_callback(partial(self._ended, record))
        self.tell("started", record)
        return record

    def require_none(self, target: str) -> None:
        """Make sure that nothing of the kind is under way for a target.

        :raises BodyBusy: it is.
        """
        if self.current(target) is not None:
            raise BodyBusy(
                f"A {self.noun} of {target} is {self.doing}; nothing was sent.",
                "Wait for its end or cancel it.",
            )

    def left_by(self, _: R, /) -> str:
        """Say what a broken-off reading has changed."""
        return "nothing was changed"

    async def close(self) -> None:
        """Break off those that are being read."""
        self._closed = True
        await super().close()

    async def _run(self, record: R, read: Callable[[], Awaitable[None]]) -> None:
        try:
            await read()
        except GatewayError as error:
            self._end(record, "failed", error)
        else:
            self._end(record, "succeeded", None)

    def _ended(self, record: R, task: "asyncio.Task[None]") -> None:
        """Note the end of what was cancelled, maybe before it had begun."""
        if task.cancelled():
            unwanted = Cancelled(
                f"The {self.noun} was cancelled by request; {self.left_by(record)}.", "Begin anew."
            )
            self._end(record, "cancelled", GatewayEnding() if self._closed else unwanted)

    def _end(self, record: R, status: JobStatus, error: GatewayError | None) -> None:
        record.status, record.ended_at, record.left_s = status, datetime.now(UTC), None
        record.error = None if error is None else BackupError.of(error)
        self.tell(status, record)

    def as_kept(self, record: R) -> R:
        """Give the form of the record that events tell."""
        return _told(record)

    def note_cut_off(self, record: R, why: CutOff, /) -> None:
        """Say how far it had come, as far as is known."""
        record.status, record.ended_at = "failed", datetime.now(UTC)
        detail = f"{why.what}. When that was noted last, {self.left_by(record)}."
        record.error = BackupError(type=why.kind, detail=detail, remedy="Begin anew.")
        self.tell("failed", record)


def _told(record: R) -> R:
    """A record without what was read: that is long."""
    results = {name for name, field in type(record).model_fields.items() if field.default is None}
    return record.model_copy(update=dict.fromkeys(results - Reading.model_fields.keys()))
