"""What a line does with an effect: in the journal before its first byte, and so is what became of it."""

import asyncio
import secrets
import time
from collections.abc import AsyncIterator, Callable, Iterable, Sequence
from contextlib import asynccontextmanager
from contextvars import ContextVar
from functools import partial
from typing import Any, Final, Generic, Protocol

from gateway.core.errors import GatewayError, NoReply
from gateway.core.exchange import X
from gateway.core.journal import writes
from gateway.core.journal.journal import JournalUnavailable
from gateway.core.journal.writes import Write
from gateway.core.lanes import STOPS, Lane, require_room
from gateway.core.origin import FENCE, POLL, PROBE, SET_UP, Origin
from protocols.table import Effect

ITS_OWN: Final = frozenset({FENCE, POLL, PROBE, SET_UP})
"""What the gateway says of its own accord is not written down."""
OF_MOVES: ContextVar[Sequence[str]] = ContextVar("of_moves", default=())
"""The moves that are made by what is asked here and now."""


_Name = tuple[int, bytes, Origin]


class Book(Protocol):
    """A journal, as far as lines are concerned."""

    def require(self) -> None:
        """Make sure that it can be written; raises JournalUnavailable."""

    def note(self, *entries: Write) -> None:
        """Write soon; nobody waits."""

    async def write(self, *entries: Write) -> None:
        """Write, and return when that is durable; raises JournalUnavailable."""


class Intents(Generic[X]):
    """The intents of one line."""

    def __init__(self, book: Book, address_of: Callable[[int], str]) -> None:
        self._book = book
        self._address_of = address_of
        self._held: dict[X, asyncio.Task[None]] = {}
        self._ahead: dict[str, _Name] = {}
        """What is durable already and not asked for yet, by the ids of the intents."""

    def must_come_first(self, exchange: X) -> bool:
        """Whether it has to be durable before the exchange may wait for its turn."""
        return exchange.lane is Lane.COMMAND and _has_effect(exchange)

    def hold(self, exchange: X, admit: Callable[[X], None]) -> None:
        """Hold an exchange back until its intent is durable; the order in which they came is kept.

        :raises JournalUnavailable: the journal cannot be written; nothing was sent.
        :raises QueueFull: too many wait for their target already.
        """
        self._book.require()
        require_room(sum(it.target == exchange.target for it in self._held), "target")
        durable = self._take_ahead(exchange)
        exchange.intent = durable or _new_id()
        self._follow(exchange)
        if durable is not None:
            admit(exchange)
            return
        writing = self._write(exchange, exchange.intent, admit)
        self._held[exchange] = asyncio.create_task(writing, name=f"intent {exchange.intent}")

    @asynccontextmanager
    async def ahead(self, exchanges: Sequence[X]) -> AsyncIterator[None]:
        """Make the intents of several exchanges durable with one commit: within, these wait for no disk.

        :raises JournalUnavailable: the journal cannot be written; nothing was sent.
        """
        named = {_new_id(): _name(exchange) for exchange in exchanges}
        try:
            await self._book.write(*map(self._entry, exchanges, named))
        except BaseException:
            self._note_unsent(named)
            raise
        self._ahead |= named
        try:
            yield
        finally:
            self._note_unsent([it for it in named if self._ahead.pop(it, None) is not None])

    def _take_ahead(self, exchange: X) -> str | None:
        name = _name(exchange)
        found = next((it for it, other in self._ahead.items() if other == name), None)
        if found is not None:
            del self._ahead[found]
        return found

    def _note_unsent(self, intents: Iterable[str]) -> None:
        ended = [writes.ended(it, time.time(), "not_sent") for it in intents]
        if ended:
            self._book.note(*ended)

    def cancel(self, unwanted: Callable[[X], bool], reason: GatewayError) -> None:
        """Admit no more what is not wanted any more."""
        for exchange in [it for it in self._held if unwanted(it)]:
            del self._held[exchange]
            exchange.settle(reason)

    def note_written(self, exchange: X) -> None:
        """Its frame is being handed to the port. A stop is written down only now: it waits for no disk."""
        now = time.time()
        if exchange.intent is not None:
            self._book.note(writes.written(exchange.intent, now))
        elif exchange.lane in STOPS and _has_effect(exchange):
            exchange.intent = _new_id()
            self._follow(exchange)
            self._book.note(self._entry(exchange, exchange.intent), writes.written(exchange.intent, now))

    async def _write(self, exchange: X, intent_id: str, admit: Callable[[X], None]) -> None:
        try:
            await self._book.write(self._entry(exchange, intent_id))
        except JournalUnavailable as error:
            if self._held.pop(exchange, None) is not None:
                exchange.settle(error)
            return
        if self._held.pop(exchange, None) is None:
            return
        try:
            admit(exchange)
        except GatewayError as error:
            exchange.settle(error)

    def _follow(self, exchange: X) -> None:
        """Wait for its outcome as everybody does, but never lose patience."""
        outcome: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        outcome.add_done_callback(partial(self._note_outcome, exchange.intent or ""))
        exchange.wait_for(outcome)

    def _note_outcome(self, intent_id: str, settled: "asyncio.Future[Any]") -> None:
        outcome = settled.result()
        detail = outcome.detail if isinstance(outcome, GatewayError) else None
        self._book.note(writes.ended(intent_id, time.time(), _name_of(outcome), detail))

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


def _name(exchange: Any) -> _Name:
    """By whom something is written to whom: so an exchange finds its intent that was written ahead."""
    return exchange.target, exchange.frame, exchange.origin


def _has_effect(exchange: Any) -> bool:
    return exchange.command.effect is not Effect.READ and exchange.origin not in ITS_OWN


def _name_of(outcome: object) -> str:
    if isinstance(outcome, NoReply):
        return "unknown"
    return "not_sent" if isinstance(outcome, GatewayError) else type(outcome).__name__.lower()


def _new_id() -> str:
    """Ids sort by time."""
    return f"{time.time_ns() // 1_000_000:012x}{secrets.token_hex(4)}"
