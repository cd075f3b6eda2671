"""The security log at work: entries are gathered on the event loop and written beside it, bursts are told."""

import asyncio
import json
import logging
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Final

from gateway.access import principal
from gateway.core.origin import GATEWAY, Origin, current
from gateway.core.supervisor import FaultsTo
from gateway.security import entries
from gateway.security.chain import Chain, Draft, draft, newest
from gateway.security.entries import Entry, EntryType
from gateway.security.folding import BUSY_WITH_REFUSALS, SINGLY_IN_ALL, Folding, Refusals

log = logging.getLogger(__name__)

WRITTEN_WITHIN_S: Final = 1.0
"""An operation waits no longer for its entry."""
CLOSED_WITHIN_S: Final = 2.0
"""Seconds to wait for the disk at the end of the gateway."""
AGAIN_S: Final = 5.0
"""Seconds until a disk that took nothing is tried again."""
MOST_WAITING: Final = 10_000
"""Entries that wait for a disk; more are lost, and counted."""
LONGEST_TARGET: Final = 256
LONGEST_DATA: Final = 4096
"""Characters of an entry's data; longer data is cut, so that no entry is large."""
FORGET_AFTER_S: Final = 3600.0
FORGET_EVERY_S: Final = 86_400.0
"""One file a day of running is forgotten at most: a clock that jumps ahead takes no more."""
WINDOWS_LOOKED_AT_S: Final = 10.0
"""Seconds between looks for windows that have ended, whose counts are then written."""


@dataclass(frozen=True)
class Keeping:
    """Settings for the keeping of the log."""

    days: float = 365.0
    """Entries that are older are forgotten."""
    refusals_per_minute: int = 30
    """More than that is a burst, and an alarm; 0 for none."""


@dataclass(frozen=True)
class Burst:
    """More refusals in a minute than happen by mistake."""

    refusals: int
    seconds: float
    type: str
    address: str | None


@dataclass
class _Backlog:
    """Entries that wait for the disk, and how many were lost since there was no room for them."""

    waiting: list[Draft] = field(default_factory=list)
    lost: int = 0

    def has_taken(self, entry: Draft) -> bool:
        """Take an entry; False where there is no room for it."""
        if len(self.waiting) >= MOST_WAITING:
            self.lost += 1
            return False
        self.waiting.append(entry)
        return True

    def batch(self) -> tuple[list[Draft], int]:
        """All that wait, and the number of the lost, which is told behind them."""
        told = [draft(entries.LOG_LOST.name, data={"lost": self.lost})] if self.lost else []
        return [*self.waiting, *told], self.lost

    def is_written(self, batch: Sequence[Draft], lost: int) -> None:
        """Forget them."""
        del self.waiting[: len(batch) - bool(lost)]
        self.lost -= lost


class SecurityLog:
    """The security log of a gateway; without a data directory it keeps nothing, and sees bursts all the same.

    Its methods belong to the event loop; none of them waits for a disk but those that say so.
    """

    def __init__(
        self,
        data: Path | None = None,
        keeping: Keeping | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.data = data
        self.keeping = keeping or Keeping()
        self.trouble: str | None = None
        """Why it cannot be written."""
        self.on_trouble: Callable[[str | None], None] = lambda _why: None
        self.on_burst: Callable[[Burst], None] = lambda _burst: None
        self.on_written: Callable[[Sequence[str]], None] = lambda _lines: None
        """Called with the lines that were written; it waits for nothing."""
        self._clock = clock
        self._chain = None if data is None else Chain(data)
        self._backlog = _Backlog()
        self._writing: asyncio.Task[None] | None = None
        self._foldings: dict[str, Folding] = {}
        self._timer: asyncio.TimerHandle | None = None
        self._refusals = Refusals(self.keeping.refusals_per_minute)
        self._forget_at = clock() + FORGET_AFTER_S
        self._closed = False

    @property
    def burst(self) -> str | None:
        """That a burst of refusals goes on, if it does."""
        return "a burst of refusals" if self._refusals.goes_on(self._clock()) else None

    # writing

    def note(self, type_: EntryType, target: str = "", *, caller: str | None = None, **data: object) -> None:
        """Put down what happens now, in the name of the present caller where no other is given.

        :raises TypeError: the data is not that of the type's row.
        """
        if data.keys() != type_.data:
            raise TypeError(f"{type_.name} has the data {sorted(type_.data)}, not {sorted(data)}")
        members = _members(target, caller, data)
        if type_.is_refusal:
            self._look_for_burst(type_, members["address"])
        if type_.folds and not self._folding(type_).stands_singly(
            (members["caller"], members["address"]), members
        ):
            self._see_to_counts()
            return
        self._put(draft(type_.name, **members))

    async def keep(self, type_: EntryType, target: str = "", **data: Any) -> None:
        """Do the same, and wait until it is on the disk, or a second where that takes it not."""
        self.note(type_, target, **data)
        if self._writing is not None:
            await asyncio.wait({self._writing}, timeout=WRITTEN_WITHIN_S)

    async def newest(self, limit: int, before: int | None = None) -> list[Entry]:
        """Read up to `limit` entries, the newest first; counts and entries that wait are written before.

        :raises OSError: they cannot be read.
        """
        if self.data is None:
            return []
        self._write_counts()
        if self._writing is not None:
            await asyncio.wait({self._writing}, timeout=WRITTEN_WITHIN_S)
        return await asyncio.to_thread(newest, self.data, limit, before)

    async def close(self) -> None:
        """Write what waits; nothing is put down any more."""
        if self._timer is not None:
            self._timer.cancel()
        self._write_counts()
        self._put(draft(entries.GATEWAY_ENDED.name))
        self._closed = True
        if self._writing is not None:
            await asyncio.wait({self._writing}, timeout=CLOSED_WITHIN_S)
            self._writing.cancel()
        if self._backlog.waiting:
            log.error("%d entries of the security log could not be written", len(self._backlog.waiting))

    def _put(self, entry: Draft) -> None:
        if self._chain is None or self._closed:
            return
        if self._backlog.has_taken(entry) and (self._writing is None or self._writing.done()):
            self._writing = asyncio.create_task(self._write(self._chain), name="security log")

    async def _write(self, chain: Chain) -> None:
        """Write all that waits, each time what has gathered meanwhile; a disk in trouble is tried again."""
        while self._backlog.waiting:
            batch, lost = self._backlog.batch()
            with FaultsTo(self._in_trouble):  # whatever it is, the next attempt may succeed
                lines = await asyncio.to_thread(chain.append, batch)
                self._backlog.is_written(batch, lost)
                self._out_of_trouble()
                self.on_written(lines)
                await self._forget(chain)
                continue
            if self._closed:
                return
            await asyncio.sleep(AGAIN_S)

    async def _forget(self, chain: Chain) -> None:
        now = self._clock()
        if now < self._forget_at or not self.keeping.days:
            return
        self._forget_at = now + FORGET_EVERY_S
        try:
            await asyncio.to_thread(chain.forget, datetime.now(UTC) - timedelta(days=self.keeping.days))
        except OSError as error:
            log.warning("old entries of the security log cannot be forgotten: %s", error)

    def _in_trouble(self, error: Exception) -> None:
        if self.trouble is None:
            self.trouble = getattr(error, "strerror", None) or str(error) or type(error).__name__
            log.error("the security log cannot be written: %s", self.trouble, exc_info=_unforeseen(error))
            self.on_trouble(self.trouble)

    def _out_of_trouble(self) -> None:
        if self.trouble is not None:
            self.trouble = None
            log.info("the security log is written again")
            self.on_trouble(None)

    # floods

    def _folding(self, type_: EntryType) -> Folding:
        busy = BUSY_WITH_REFUSALS if type_.is_refusal else SINGLY_IN_ALL
        folding = self._foldings.setdefault(type_.name, Folding(busy))
        now = self._clock()
        if folding.is_over(now):
            self._write_count(type_.name, folding)
            folding.begin(now)
        return folding

    def _see_to_counts(self) -> None:
        """Write what is counted when the windows end, though nothing more should come."""
        if self._timer is None:
            self._timer = asyncio.get_running_loop().call_later(WINDOWS_LOOKED_AT_S, self._look_at_windows)

    def _look_at_windows(self) -> None:
        self._timer = None
        now = self._clock()
        for name, folding in self._foldings.items():
            if folding.is_counting and folding.is_over(now):
                self._write_count(name, folding)
        if any(folding.is_counting for folding in self._foldings.values()):
            self._see_to_counts()

    def _write_counts(self) -> None:
        for name, folding in self._foldings.items():
            self._write_count(name, folding)

    def _write_count(self, name: str, folding: Folding) -> None:
        for (caller, address), counted in folding.taken():
            members = {**counted.last, "caller": caller, "address": address}
            self._put(draft(name, **members, count=counted.number, since=counted.since))

    def _look_for_burst(self, type_: EntryType, address: str | None) -> None:
        took_s, most = self._refusals.began_burst(self._clock()), self.keeping.refusals_per_minute
        if took_s is not None:
            log.warning("more than %d requests in a minute are refused, the last from %s", most, address)
            self.on_burst(Burst(most + 1, round(took_s, 1), type_.name, address))


def _members(target: str, caller: str | None, data: Mapping[str, object]) -> dict[str, Any]:
    """The members of an entry, in the name of the present caller where no other is given."""
    origin = current()
    by_itself = caller == GATEWAY.caller
    return {
        "target": _cut(target),
        "caller": caller or _caller(origin),
        "address": None if by_itself else origin.address or None,
        "request_id": None if by_itself else origin.request_id,
        "data": _bounded(data),
    }


def _caller(origin: Origin) -> str | None:
    """The name of the client's key, if it is known; what is no client has a name of its own."""
    if not origin.address:
        return origin.caller
    who = principal.PRINCIPAL.get()
    return None if who is None else who.name


def _cut(text: str) -> str:
    return text if len(text) <= LONGEST_TARGET else f"{text[: LONGEST_TARGET - 1]}…"


def _bounded(data: Mapping[str, object]) -> Mapping[str, object]:
    written = json.dumps(data)
    if len(written) <= LONGEST_DATA:
        return data
    return {"cut": written[: LONGEST_DATA - 64]}


def _unforeseen(error: Exception) -> Exception | None:
    return None if isinstance(error, OSError) else error
