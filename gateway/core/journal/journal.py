"""The journal at work: one thread writes, all that waits goes into one commit, trouble is told at once."""

import asyncio
import logging
import threading
import time
from collections.abc import Callable, Hashable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any, Final

from gateway.core.drawn import Transition
from gateway.core.errors import NotSent
from gateway.core.journal import writes
from gateway.core.journal.disk import Disk, DiskFailed, NotWritable
from gateway.core.journal.writes import Retention, Value, Write, forget
from gateway.core.supervisor import FaultsTo

log = logging.getLogger(__name__)

WRITTEN_WITHIN_S = 1.0
"""Seconds for which a write to the disk is waited for."""
CHECK_S = 5.0
"""Seconds between checks that a quiet journal's file is there, and between the tries of one in trouble."""
SYNCED_WITHIN_S = 1.0
"""Seconds after which an unawaited write is safe from a loss of power."""
NOTED_WITHIN_S = 0.02
"""Seconds for which unawaited writes are gathered."""
MOST_AT_ONCE = 1000
"""Entries of one commit."""
MOST_OWED = 50_000
"""Unawaited writes kept while the disk is full."""


class JournalUnavailable(NotSent):
    """A command with an effect cannot be written down, so it is not sent."""

    kind = "journal-unavailable"

    def __init__(self, why: str, *, failed: bool = False) -> None:
        super().__init__("")
        self.reword("journal.failed" if failed else "journal.unavailable", why=why)

    def __str__(self) -> str:
        return self.detail


@dataclass(eq=False, slots=True)
class JournalEntry:
    """Writes that belong together, and the future of the one who waits for them."""

    writes: Sequence[Write]
    done: "asyncio.Future[None] | None" = None


@dataclass(eq=False, slots=True)
class JournalQuestion:
    """Rows that are asked for, behind all that was written before."""

    sql: str
    values: Sequence[Value]
    answer: "asyncio.Future[list[tuple[Any, ...]]]"


class DiskState(Enum):
    """State of the disk, by the way it takes writes."""

    WORKS = "written"
    LATE = "takes nothing in time"
    FULL = "refuses"
    FAILED = "not trusted again in this process"


class DiskNews(Enum):
    """News of the disk."""

    TAKEN = "a commit is done"
    LATE = "a commit takes too long"
    REFUSED = "no room, or another program holds the file"
    FAILED = "it is not known what was written"


class DiskAction(Enum):
    """Reaction to news of the disk."""

    NONE = ""
    TELL_TROUBLE = "refuse what has an effect, tell journal.trouble"
    TELL_WORKS = "tell journal.recovered"


DiskStep = Transition[DiskState, DiskAction]


def _in_trouble(late: DiskState) -> Mapping[DiskNews, DiskStep]:
    """The row of a disk whose trouble was told."""
    return {
        DiskNews.TAKEN: DiskStep(DiskState.WORKS, DiskAction.TELL_WORKS),
        DiskNews.LATE: DiskStep(late, DiskAction.NONE),
        DiskNews.REFUSED: DiskStep(DiskState.FULL, DiskAction.NONE),
        DiskNews.FAILED: DiskStep(DiskState.FAILED, DiskAction.NONE),
    }


TABLE: Final[Mapping[DiskState, Mapping[DiskNews, DiskStep]]] = {
    DiskState.WORKS: {
        DiskNews.TAKEN: DiskStep(DiskState.WORKS, DiskAction.NONE),
        DiskNews.LATE: DiskStep(DiskState.LATE, DiskAction.TELL_TROUBLE),
        DiskNews.REFUSED: DiskStep(DiskState.FULL, DiskAction.TELL_TROUBLE),
        DiskNews.FAILED: DiskStep(DiskState.FAILED, DiskAction.TELL_TROUBLE),
    },
    DiskState.LATE: _in_trouble(late=DiskState.LATE),
    DiskState.FULL: _in_trouble(late=DiskState.FULL),
    DiskState.FAILED: dict.fromkeys(DiskNews, DiskStep(DiskState.FAILED, DiskAction.NONE)),
}


def _news(error: OSError | None) -> DiskNews:
    if error is None:
        return DiskNews.TAKEN
    return DiskNews.FAILED if isinstance(error, DiskFailed) else DiskNews.REFUSED


Settle = Callable[[list[JournalEntry], OSError | None], None]
"""Takes the outcome of a commit."""


@dataclass(eq=False)
class Writer:
    """The thread that writes to the disk. Its methods are called in it, one after the other."""

    disk: Disk
    retention: Retention = field(default_factory=Retention)
    ran_s: float = 0.0
    """Seconds for which gateways have run on this journal."""
    failure: DiskFailed | None = None
    """Why the file is not trusted again in this process."""
    settle: Settle = lambda _entries, _error: None
    waiting: "SimpleQueue[Sequence[JournalEntry | JournalQuestion | None]]" = field(
        default_factory=SimpleQueue
    )
    """Work for it; None ends it."""
    owed: list[Write] = field(default_factory=list)
    """Unawaited writes kept while the disk is full, in their order."""
    _forgot: bool = False
    """Some of these were too many: the next life has to begin as after a crash."""
    _unsynced_since: float | None = None
    _counted_at: float = field(default_factory=lambda: time.monotonic())
    """Time until which `ran_s` is counted."""

    def run(self) -> None:
        """Write until the end is asked for."""
        looked_at = time.monotonic()
        while True:
            taken = self.take()
            if not self.write(taken):
                return
            if not taken or time.monotonic() - looked_at > CHECK_S:
                self.look()
                looked_at = time.monotonic()

    def write(self, taken: "Sequence[JournalEntry | JournalQuestion | None]") -> bool:
        """Write in one commit, then answer the question; False at the end."""
        entries = [each for each in taken if isinstance(each, JournalEntry)]
        if entries:
            self._commit(entries)
        for question in taken:
            if isinstance(question, JournalQuestion):
                self._answer(question)
        if None not in taken:
            return True
        if not self._forgot:  # else the end is not clean
            self._try([writes.meta("clean", "1")], durable=True)
        return False

    def take(self) -> "list[JournalEntry | JournalQuestion | None]":
        """Give what waits, in its order, up to a question: that is answered after what came before it."""
        quiet_s = CHECK_S if self._unsynced_since is None else SYNCED_WITHIN_S
        taken: list[JournalEntry | JournalQuestion | None] = []
        with suppress(Empty):
            taken += self.waiting.get(timeout=quiet_s)
            while len(taken) < MOST_AT_ONCE and isinstance(taken[-1], JournalEntry):
                taken += self.waiting.get_nowait()
        return taken

    def _commit(self, entries: list[JournalEntry]) -> None:
        now = time.monotonic()
        waited_for = any(entry.done is not None for entry in entries)
        overdue = self._unsynced_since is not None and now - self._unsynced_since >= SYNCED_WITHIN_S
        durable = waited_for or overdue
        error = self._try([write for entry in entries for write in entry.writes], durable=durable)
        if error is None:
            self._unsynced_since = None if durable else self._unsynced_since or now
        else:
            self._owe([write for entry in entries if entry.done is None for write in entry.writes])
        self.settle(entries, error)

    def _try(self, batch: Sequence[Write], *, durable: bool) -> OSError | None:
        if self.failure is not None:
            return self.failure
        error = self._attempt(partial(self.disk.commit, [*self.owed, *batch], durable=durable))
        if error is None:
            self.owed.clear()
        return error

    def _attempt(self, *deeds: Callable[[], None]) -> OSError | None:
        """Do something with the disk; whatever is unforeseen there is the disk's failure."""
        with FaultsTo(self._distrust):  # a thread that ended would leave everybody waiting
            try:
                for deed in deeds:
                    deed()
            except NotWritable as error:
                return error
        return self.failure

    def _distrust(self, fault: Exception) -> DiskFailed:
        """Trust the file no more, whatever happened to it."""
        if not isinstance(fault, DiskFailed):
            log.error("the journal has failed in a way that nobody has foreseen", exc_info=fault)
            fault = DiskFailed(f"{type(fault).__name__}: {fault}")
        self.failure = fault
        return fault

    def _owe(self, batch: Sequence[Write]) -> None:
        room = MOST_OWED - len(self.owed)
        self._forgot = self._forgot or len(batch) > room
        self.owed += batch[: max(room, 0)]

    def _answer(self, question: JournalQuestion) -> None:
        call = question.answer.get_loop().call_soon_threadsafe
        with FaultsTo(lambda fault: call(_fail, question.answer, fault)):  # it belongs to the caller
            call(_give, question.answer, self.disk.rows(question.sql, question.values))

    def look(self) -> None:
        """Sync, forget what is old, try again after trouble, and see that the file is there."""
        facts = {"seen_at": str(time.time()), writes.RAN_S: str(self._count())}
        known = [writes.meta(name, value) for name, value in facts.items()]
        error = self._try([*known, *forget(self.ran_s, self.retention)], durable=True)
        if error is None:
            error = self._attempt(self.disk.check, self.disk.tidy)
            if isinstance(error, NotWritable):
                log.warning("the journal could not be tidied: %s", error)
                error = None
        self._unsynced_since = None
        self.settle([], error)

    def _count(self) -> float:
        """For how long gateways have run by now."""
        now = time.monotonic()
        self.ran_s += now - self._counted_at
        self._counted_at = now
        return self.ran_s


class Journal:
    """The journal of one disk. Its methods belong to the event loop's thread."""

    def __init__(
        self,
        disk: Disk,
        *,
        ran_s: float = 0.0,
        trouble: str | None = None,
        failure: DiskFailed | None = None,
    ) -> None:
        self.disk = disk
        self.writer = Writer(disk, ran_s=ran_s, failure=failure)
        self.trouble = trouble
        """Why it cannot be written."""
        troubled = DiskState.WORKS if trouble is None else DiskState.FULL
        self._state = troubled if failure is None else DiskState.FAILED
        self.on_trouble: Callable[[str | None], None] = lambda _why: None
        """Called with the reason when it cannot be written any more, and with None when it can again."""
        self.lag_s = 0.0
        """Seconds that the last awaited commit has taken."""
        self._noted: list[Write] = []
        """Unawaited writes that the writer does not have yet: to wake it costs more than to write."""
        self._newest: dict[Hashable, Callable[[], Write]] = {}
        """Unawaited writes of rows of which only the newest state counts."""
        self._due: asyncio.TimerHandle | None = None
        """Timer at whose end the writer has these at the latest."""
        self._thread: threading.Thread | None = None
        self._loop: asyncio.AbstractEventLoop

    @property
    def failed(self) -> bool:
        """True if the file is not trusted again in this process."""
        return self._state is DiskState.FAILED

    def start(self) -> None:
        """Begin to write, beside the event loop."""
        self._loop = asyncio.get_running_loop()
        self.writer.settle = self._settle_soon
        self._thread = threading.Thread(target=self.writer.run, name="journal", daemon=True)
        self._thread.start()

    async def close(self) -> None:
        """Write what waits, mark the end as clean, and release the file."""
        self.on_trouble = lambda _why: None  # what is told from now on is not written any more
        self._put(None)
        if self._thread is not None:
            await asyncio.to_thread(self._thread.join)
        self.disk.close()

    def waiting(self) -> int:
        """Count the entries that wait to be written."""
        return self.writer.waiting.qsize() + (self._due is not None)

    def require(self) -> None:
        """Make sure that what has an effect can be written down.

        :raises JournalUnavailable: it cannot.
        """
        if self.trouble is not None:
            raise JournalUnavailable(self.trouble, failed=self.failed)

    def note(self, *entries: Write) -> None:
        """Write soon, without waiting."""
        self._hand_over_soon()
        self._noted += entries

    def note_newest(self, row: Hashable, write: Callable[[], Write]) -> None:
        """Write a row soon, as `write` gives it then, without waiting."""
        self._hand_over_soon()
        self._newest[row] = write

    def write(self, *entries: Write) -> "asyncio.Future[None]":
        """Write; what is given is done when a loss of power cannot undo it.

        It ends with JournalUnavailable where the disk does not take it, or not in time.

        :raises JournalUnavailable: it is known that the disk will not.
        """
        self.require()
        done: asyncio.Future[None] = self._loop.create_future()
        self._put(JournalEntry(entries, done))
        overdue = self._loop.call_later(WRITTEN_WITHIN_S, self._give_up, done)
        done.add_done_callback(partial(self._end_of, overdue, time.monotonic()))
        return done

    def _give_up(self, done: "asyncio.Future[None]") -> None:
        if not done.done():
            self._take(DiskNews.LATE, f"the disk has taken nothing for {WRITTEN_WITHIN_S:g} s")
            done.set_exception(JournalUnavailable(self.trouble or ""))

    def _end_of(self, overdue: asyncio.TimerHandle, began_at: float, _: "asyncio.Future[None]") -> None:
        overdue.cancel()
        self.lag_s = time.monotonic() - began_at

    async def rows(self, sql: str, *values: Value) -> list[tuple[Any, ...]]:
        """Read rows, after all that was written before."""
        answer: asyncio.Future[list[tuple[Any, ...]]] = self._loop.create_future()
        self._put(JournalQuestion(sql, values, answer))
        return await answer

    def _put(self, item: JournalEntry | JournalQuestion | None) -> None:
        """Let the writer have this, and what was noted before with it: in one commit."""
        noted = self._take_noted()
        self.writer.waiting.put([JournalEntry(noted), item] if noted else [item])

    def _hand_over_soon(self) -> None:
        if self._due is None:
            self._due = asyncio.get_running_loop().call_later(NOTED_WITHIN_S, self._hand_over)

    def _hand_over(self) -> None:
        """Let the writer have what was noted."""
        self.writer.waiting.put([JournalEntry(self._take_noted())])

    def _take_noted(self) -> list[Write]:
        if self._due is None:
            return []
        self._due.cancel()
        self._due = None
        newest, self._newest = self._newest, {}
        noted, self._noted = [*self._noted, *(write() for write in newest.values())], []
        return noted

    def owe(self, entries: Sequence[Write], why: NotWritable) -> None:
        """Begin in trouble: these are written first, when a disk that was full has room."""
        self.writer.owed, self.trouble, self._state = [*entries], str(why), DiskState.FULL

    # what becomes of it

    def _settle_soon(self, entries: list[JournalEntry], error: OSError | None) -> None:
        """Called in the writer's thread: nothing is told where nothing is new and no caller waits."""
        waited_for = any(entry.done is not None for entry in entries)
        if waited_for or error is not None or self.trouble is not None:
            self._loop.call_soon_threadsafe(self._settle, entries, error)

    def _settle(self, entries: list[JournalEntry], error: OSError | None) -> None:
        self._take(_news(error), str(error))
        for entry in entries:
            if entry.done is not None and not entry.done.done():
                if error is None:
                    entry.done.set_result(None)
                else:
                    entry.done.set_exception(JournalUnavailable(str(error), failed=self.failed))

    def _take(self, news: DiskNews, why: str) -> None:
        self._state, action = TABLE[self._state][news]
        if action is DiskAction.TELL_TROUBLE:
            log.error("the journal cannot be written: %s; nothing with an effect is sent", why)
            self.trouble = why
            self.on_trouble(why)
        elif action is DiskAction.TELL_WORKS:
            log.info("the journal is written again")
            self.trouble = None
            self.on_trouble(None)


def _give(answer: "asyncio.Future[list[tuple[Any, ...]]]", rows: list[tuple[Any, ...]]) -> None:
    if not answer.done():
        answer.set_result(rows)


def _fail(answer: "asyncio.Future[list[tuple[Any, ...]]]", error: Exception) -> None:
    if not answer.done():
        answer.set_exception(error)
