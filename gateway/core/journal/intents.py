"""Intents: frames with an effect are in the journal before their first byte, and later their outcomes."""

import asyncio
import time
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial
from typing import Any, Final, Generic, NamedTuple, Protocol

from gateway.core.errors import GatewayError, NoReply
from gateway.core.exchange import QUEUE_LIMIT, STOPS, Lane, X, current_series, require_room
from gateway.core.journal import writes
from gateway.core.journal.journal import JournalUnavailable
from gateway.core.journal.writes import Write
from gateway.core.origin import FENCE, POLL, PROBE, SET_UP, sorted_by_time
from protocols.table import Effect

ITS_OWN: Final = frozenset({FENCE, POLL, PROBE, SET_UP})
"""Origins of frames that the gateway sends on its own, and does not write down."""
NOT_SENT: Final = "not_sent"
"""The outcome of what was not handed to the port."""
OF_MOVES: ContextVar[Sequence[str]] = ContextVar("of_moves", default=())
"""The moves that are made by what is asked here and now."""
GATHERED_WITHIN_S: Final = 0.005
"""Seconds for which a command that waits for its turn anyway may wait for others to share its commit."""


class Book(Protocol):
    """A journal, as far as lines are concerned."""

    def require(self) -> None:
        """Make sure that it can be written; raises JournalUnavailable."""

    def note(self, *entries: Write) -> None:
        """Write soon, without waiting."""

    def note_newest(self, row: Hashable, write: Callable[[], Write]) -> None:
        """Write a row soon, as the last that is given for it, without waiting."""

    def write(self, *entries: Write) -> "asyncio.Future[None]":
        """Write; done when that is durable, or with JournalUnavailable."""


class _Undertaking(Generic[X]):
    """The commands that an operation is going to send, and their intents that are not used yet."""

    def __init__(self, line: "Intents[X]", commands: Callable[[], Iterable[X]]) -> None:
        self.line = line
        self._commands: Callable[[], Iterable[X]] | None = commands
        self._unused: defaultdict[bytes, list[str]] = defaultdict(list)
        """Durable intents by frame."""
        self._durable: set[str] = set()
        self.is_open = True

    def still_to_come(self, first: X) -> list[X]:
        """Give the commands that are to be written down with the first one; only once."""
        commands, self._commands = self._commands, None
        found = [] if commands is None else list(commands())
        place = next((place for place, intent in enumerate(found) if intent.frame == first.frame), -1)
        return found[place + 1 :]

    def note_durable(self, intent_id: str) -> None:
        """An intent of it cannot be lost any more."""
        self._durable.add(intent_id)

    def is_durable(self, intent_id: str) -> bool:
        """Say whether the intent can be used again, as nothing was written for it."""
        return self.is_open and intent_id in self._durable

    def keep(self, frame: bytes, intent_id: str) -> None:
        """Nothing was written for it yet."""
        self._unused[frame].append(intent_id)

    def take(self, frame: bytes) -> str | None:
        """An intent to write this frame, if one is durable."""
        unused = self._unused.get(frame)
        return unused.pop(0) if unused else None

    def end(self) -> list[str]:
        """Nothing more comes; gives the intents that nothing was written for."""
        self.is_open = False
        return [intent for unused in self._unused.values() for intent in unused]


_UNDERTAKING: ContextVar[_Undertaking[Any] | None] = ContextVar("undertaking", default=None)


class _Held(NamedTuple, Generic[X]):
    """An exchange that waits for the disk."""

    exchange: X
    intents: Mapping[str, X]
    """Intents of the exchange itself, and of those that are written down with it."""
    whole: _Undertaking[X] | None
    entries: Sequence[Write]
    admit: Callable[[X], None]

    @property
    def others(self) -> list[str]:
        """The intents beside its own."""
        return list(self.intents)[1:]


class Intents(Generic[X]):
    """The intents of one line."""

    def __init__(self, book: Book, address_of: Callable[[int], str]) -> None:
        self._book = book
        self._address_of = address_of
        self._held: dict[X, None] = {}
        """Exchanges that wait for the disk, in order."""
        self._gathered: list[_Held[X]] = []
        """Held exchanges that the disk was not given yet."""
        self._ahead: set[X] = set()
        """Exchanges that are durable, and wait for their turn on the line."""
        self._written: dict[X, float] = {}
        """Times at which exchanges that await their outcomes were handed to the port."""
        self._due: asyncio.TimerHandle | None = None
        """Timer at whose end the disk is given what was gathered, if not before."""

    @contextmanager
    def undertaking(self, commands: Callable[[], Iterable[X]]) -> Iterator[None]:
        """Write the intents of all commands of an operation with that of its first, so that it waits once.

        `commands` is asked then. Commands that the operation does without are noted as not sent.
        """
        if self._present() is not None:
            yield  # a part of a larger one
            return
        whole = _Undertaking(self, commands)
        before = _UNDERTAKING.set(whole)
        try:
            yield
        finally:
            _UNDERTAKING.reset(before)
            self._drop(whole.end())

    def _present(self) -> _Undertaking[X] | None:
        """The undertaking of this line that is carried out here and now."""
        whole = _UNDERTAKING.get()
        return whole if whole is not None and whole.line is self and whole.is_open else None

    def must_come_first(self, exchange: X) -> bool:
        """Say whether its intent has to be durable before the exchange may wait for its turn."""
        wanted = exchange.lane is Lane.COMMAND and _has_effect(exchange)
        return wanted and not self._only_asks(exchange)

    def _only_asks(self, exchange: X) -> bool:
        """Say whether it serves a question: questions go on, and stops are proved, without a journal."""
        if not exchange.command.for_questions or self._present() is not None:
            return False
        try:
            self._book.require()
        except JournalUnavailable:
            return True
        return False

    def hold(self, exchange: X, admit: Callable[[X], None]) -> None:
        """Hold an exchange back until its intent is durable; the order in which they came is kept.

        :raises JournalUnavailable: the journal cannot be written; nothing was sent.
        :raises QueueFull: too many wait for their target already.
        """
        self._book.require()
        whole = self._present()
        known = None if whole is None else whole.take(exchange.frame)
        if known is not None:
            exchange.intent = known
            self._follow(exchange, whole)
            self._ahead.add(exchange)
            _admit(exchange, admit)
            return
        if len(self._held) >= QUEUE_LIMIT:
            require_room(sum(held.target == exchange.target for held in self._held), "target")
        exchange.intent = own = _new_id()
        to_come = [] if whole is None else whole.still_to_come(exchange)
        intents = {own: exchange} | {f"{own}{place:04x}": later for place, later in enumerate(to_come, 1)}
        entries = [self._entry(intent, intent_id) for intent_id, intent in intents.items()]
        self._follow(exchange, whole)
        self._held[exchange] = None
        self._gathered.append(_Held(exchange, intents, whole, entries, admit))
        if not self._ahead or current_series() is not None:
            self._write_down()
        elif self._due is None:
            self._due = asyncio.get_running_loop().call_later(GATHERED_WITHIN_S, self._write_down)

    def _write_down(self) -> None:
        """Give the disk what was gathered."""
        gathered, self._gathered = self._gathered, []
        if self._due is not None:
            self._due.cancel()
            self._due = None
        try:
            durable = self._book.write(*(entry for held in gathered for entry in held.entries))
        except JournalUnavailable as error:
            self._refuse(gathered, error)
        else:
            durable.add_done_callback(partial(self._go_on, gathered))

    def cancel(self, unwanted: Callable[[X], bool], reason: GatewayError) -> None:
        """Admit no more what is not wanted any more."""
        if self._gathered:
            self._write_down()  # before it is noted what became of it
        for exchange in [held for held in self._held if unwanted(held)]:
            del self._held[exchange]
            exchange.settle(reason)

    def note_written(self, exchange: X) -> None:
        """Note that its frame is being handed to the port.

        A stop is written down only now: it waits for no disk.
        """
        now = time.time()
        if exchange.intent is not None:
            self._no_longer_ahead(exchange)
        elif exchange.lane in STOPS and _has_effect(exchange):
            exchange.intent = _new_id()
            self._follow(exchange)
            self._book.note(self._entry(exchange, exchange.intent))
        else:
            return
        self._written[exchange] = now
        self._book.note_newest(exchange, partial(writes.written, exchange.intent, now))

    def _no_longer_ahead(self, exchange: X) -> None:
        """Note that its turn has come, or never will: after the last one others need intents at once."""
        self._ahead.discard(exchange)
        if self._gathered and not self._ahead:
            self._write_down()

    def _go_on(self, gathered: Iterable[_Held[X]], durable: "asyncio.Future[None]") -> None:
        """The intents are durable, or cannot be written."""
        error = durable.exception()
        if isinstance(error, JournalUnavailable):
            self._refuse(gathered, error)
            return
        wanted = [held for held in gathered if held.exchange in self._held]
        self._ahead.update(held.exchange for held in wanted)
        for held in gathered:
            if held.whole is not None:
                self._share(held, held.whole)
        for held in wanted:
            if held.exchange in self._held:  # not where the port was lost with the one before
                del self._held[held.exchange]
                _admit(held.exchange, held.admit)

    def _share(self, held: _Held[X], whole: _Undertaking[X]) -> None:
        """Let the rest of its undertaking use what was written down with it."""
        if not whole.is_open:
            self._drop(held.others)
            return
        for intent_id, exchange in held.intents.items():
            whole.note_durable(intent_id)
            if exchange is not held.exchange:
                whole.keep(exchange.frame, intent_id)

    def _refuse(self, gathered: Iterable[_Held[X]], error: JournalUnavailable) -> None:
        """Send nothing of it."""
        for held in gathered:
            self._drop(held.others)
            if held.exchange in self._held:
                del self._held[held.exchange]
                held.exchange.settle(error)

    def _follow(self, exchange: X, whole: _Undertaking[X] | None = None) -> None:
        """Wait for its outcome before everybody else, and never lose patience."""
        outcome: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        outcome.add_done_callback(partial(self._note_outcome, exchange, whole))
        exchange.waiters = {outcome: exchange.expires_at} | exchange.waiters

    def _note_outcome(
        self, exchange: X, whole: _Undertaking[X] | None, settled: "asyncio.Future[Any]"
    ) -> None:
        self._no_longer_ahead(exchange)
        outcome, intent_id = settled.result(), exchange.intent or ""
        name, written_at = _name_of(outcome), self._written.pop(exchange, None)
        if name == NOT_SENT and whole is not None and whole.is_durable(intent_id):
            whole.keep(exchange.frame, intent_id)  # it may be tried again
            return
        end = partial(writes.ended, intent_id, time.time(), name, _why(outcome), written_at)
        self._book.note_newest(exchange, end)

    def _drop(self, intent_ids: Iterable[str]) -> None:
        """Nothing will be written for these."""
        for intent_id in intent_ids:
            self._book.note(writes.ended(intent_id, time.time(), NOT_SENT))

    def _entry(self, exchange: X, intent_id: str) -> Write:
        return writes.intent(
            intent_id,
            time.time(),
            target=self._address_of(exchange.target),
            command=exchange.command.name(),
            effect=exchange.command.effect,
            frame=exchange.frame.decode("ascii", "backslashreplace"),
            caller=exchange.origin.caller,
            request_id=exchange.origin.request_id,
            move_id=" ".join(OF_MOVES.get()) or None,
            key=exchange.origin.key,
        )


def _has_effect(exchange: Any) -> bool:
    return exchange.command.effect is not Effect.READ and exchange.origin not in ITS_OWN


def _admit(exchange: X, admit: Callable[[X], None]) -> None:
    try:
        admit(exchange)
    except GatewayError as error:
        exchange.settle(error)


def _name_of(outcome: object) -> str:
    if isinstance(outcome, NoReply):
        return "unknown"
    return NOT_SENT if isinstance(outcome, GatewayError) else getattr(outcome, "told_as", "answered")


def _why(outcome: object) -> str | None:
    """Why it was not carried out, or with which error of the controller."""
    if isinstance(outcome, GatewayError):
        return outcome.detail
    error: int | str | None = getattr(outcome, "error", None)
    code = f"0x{error:02X}" if isinstance(error, int) else error
    return None if code is None else f"The controller told {code}."


def _new_id() -> str:
    """Ids sort by time."""
    return sorted_by_time(time.time_ns() // 1_000_000)
