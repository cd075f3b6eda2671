"""Long work, each with a record: done in a task of its own, and found again when it is over.

Records of work that changes controllers outlive the gateway, and what was cut off is told.
"""

import asyncio
import logging
from abc import abstractmethod
from collections import OrderedDict
from collections.abc import Callable, Coroutine, Iterable, Iterator
from datetime import datetime
from functools import partial
from math import inf
from typing import Any, ClassVar, Final, Generic, NamedTuple, Protocol, TypeVar

from pydantic import BaseModel

from gateway.core.errors import NotFound
from protocols.wording import as_given

log = logging.getLogger(__name__)


class CutOff(NamedTuple):
    """Why work has not come to its end."""

    kind: str
    """The kind of its error."""
    what: str
    """The reason as the beginning of a sentence."""


GATEWAY_ENDED: Final = CutOff("gateway-ended", "The gateway has ended in the middle of it")
OWN_FAULT: Final = CutOff("gateway-fault", "A fault of the gateway itself has ended it")


class WorkRecord(Protocol):
    """A record of work."""

    @property
    def id(self) -> str:
        """Id that the record is found by."""


W = TypeVar("W", bound=WorkRecord)


class Jobs(Generic[W]):
    """The work of one kind: all that is under way, and the newest of what is over."""

    doing: ClassVar = "running"

    def __init__(self, history: int, what: str, subject_of: Callable[[W], str]) -> None:
        self._history = history
        """Records that are kept; those under way always are."""
        self._what, self._subject_of = what, subject_of
        """Noun for the work, and function that names its subject."""
        self._records: OrderedDict[str, W] = OrderedDict()
        self._tasks: dict[str, asyncio.Task[None]] = {}

    def begin(self, record: W, work: Coroutine[Any, Any, None], name: str) -> "asyncio.Task[None]":
        """Keep a record, and do its work in a task of this name; a fault of the gateway itself ends it."""
        task = asyncio.create_task(work, name=f"{name} {record.id}")
        self._tasks[record.id] = task
        task.add_done_callback(partial(self._over, record))
        self._keep(record)
        return task

    def _over(self, record: W, task: "asyncio.Task[None]") -> None:
        del self._tasks[record.id]
        fault = None if task.cancelled() else task.exception()
        if fault is not None:
            log.error("%s has met a fault of the gateway itself", task.get_name(), exc_info=fault)
            self.cut_off(record, OWN_FAULT)

    def cut_off(self, record: W, why: CutOff, /) -> None:
        """Say in a record that its work has not come to its end, and what that has left."""

    def _keep(self, record: W) -> None:
        """Keep a record, and let go the oldest of those that are over and too many."""
        self._records[record.id] = record
        over = [record_id for record_id in self._records if record_id not in self._tasks]
        for record_id in over[: max(len(self._records) - self._history, 0)]:
            del self._records[record_id]

    def under_way(self) -> Iterator[W]:
        """The records of what is not over, oldest first."""
        return (self._records[record_id] for record_id in self._tasks)

    def current(self, subject: str) -> W | None:
        """The record of what is done to something now."""
        return next((record for record in self.under_way() if self._subject_of(record) == subject), None)

    def goes_on(self, record: W) -> bool:
        """Say whether the work of a record is not over."""
        return record.id in self._tasks

    def find(self, subject: str, record_id: str = "current") -> W | None:
        """Find a record of what is done to something, if it is kept; `current` is the newest."""
        newest = (
            record for record in reversed(self._records.values()) if self._subject_of(record) == subject
        )
        return next((record for record in newest if record_id in ("current", record.id)), None)

    async def get(self, subject: str, record_id: str, timeout_s: float = 0.0) -> W:
        """Give a record, as `find` does, when its work is over, or as it is when the time is up.

        :raises NotFound: there is none, or it is no longer kept.
        """
        found = self.find(subject, record_id)
        if found is None:
            raise NotFound(f"{subject} has no {self._what} {as_given(record_id)}, or it is no longer kept.")
        await self.wait(found, timeout_s)
        return found

    async def wait(self, record: W, timeout_s: float) -> None:
        """Wait until work is over, or the time is up."""
        if timeout_s > 0 and (task := self._tasks.get(record.id)) is not None:
            await asyncio.wait([task], timeout=timeout_s)

    def break_off(self, record: W) -> None:
        """Cancel work, if it is under way."""
        if (task := self._tasks.get(record.id)) is not None:
            task.cancel()

    async def cancel(self, subject: str) -> W:
        """Break off what is done to something, and give its record.

        :raises NotFound: nothing is under way.
        """
        record = self.current(subject)
        if record is None:
            raise NotFound(f"No {self._what} of {subject} is {self.doing}.")
        self.break_off(record)
        await self.wait(record, inf)
        return record

    async def close(self) -> None:
        """Break off all work."""
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


class Dated(WorkRecord, Protocol):
    """A record that says when its work was over."""

    started_at: datetime
    ended_at: datetime | None


K = TypeVar("K", bound=Dated)


class DurableJobs(Jobs[K]):
    """The work of one kind; each change of a record that is worth an event is worth to be kept."""

    record_type: ClassVar[type[BaseModel]]

    def __init__(
        self,
        history: int,
        what: str,
        subject_of: Callable[[K], str],
        publish: Callable[[str, K], None],
    ) -> None:
        super().__init__(history, what, subject_of)
        self._publish = publish
        self.on_change: Callable[[K], None] = lambda _record: None
        """Called with each record that has changed."""

    def tell(self, what: str, record: K) -> None:
        """Tell how far work has come, or how it has ended."""
        self.on_change(record)
        self._publish(what, record)

    def as_kept(self, record: K) -> Any:
        """Give the form in which a record is kept."""
        return record

    def resume(self, records: Iterable[str]) -> None:
        """Remember the work of an earlier life, oldest first; what was not over then was cut off."""
        for text in records:
            try:
                record: Any = self.record_type.model_validate_json(text)
            except ValueError:
                log.warning(
                    "a %s of an earlier life cannot be read, and is forgotten: %.200r", self._what, text
                )
                continue
            self._keep(record)
            self.cut_off(record, GATEWAY_ENDED)

    def cut_off(self, record: K, why: CutOff, /) -> None:
        """Say so in a record that has not told its end yet."""
        if record.ended_at is None:
            self.note_cut_off(record, why)

    @abstractmethod
    def note_cut_off(self, record: K, why: CutOff, /) -> None:
        """Say in a record why its work has not come to its end, and what that has left."""


EXCHANGE_BYTES: Final = 27
"""Bytes of a question and its answer, as a mean over a backup."""
TURNAROUND_S: Final = 0.004
"""Seconds from the end of a question to its answer, and from that to the next question."""
PACED: Final = 50
"""Answers after which the pace says more than the speed of the line."""


def answer_s(baud: int) -> float:
    """The seconds that a question and its answer take at a baud rate."""
    return 10 * EXCHANGE_BYTES / baud + TURNAROUND_S


def left_s(expected: int | None, done: int, took_s: float, baud: int | None) -> float | None:
    """Seconds until `expected` answers have come, of which `done` took `took_s`; None if unknown."""
    if expected is None or (done < PACED and baud is None):
        return None
    each = took_s / done if done >= PACED or baud is None else answer_s(baud)
    return round(max(0, expected - done) * each, 1)
