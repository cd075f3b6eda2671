"""Idempotency keys: what was done under each is in the journal, with the intents of its request."""

import asyncio
import time
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NamedTuple

from gateway.core.errors import Ambiguous, InvalidRequest, NoReply, NotFound
from gateway.core.journal import writes
from gateway.core.journal.journal import Journal, JournalUnavailable
from gateway.core.journal.writes import Value
from gateway.core.move_record import MoveRecord
from gateway.core.targets import BegunMoves
from gateway.plant import Plant

ASKED_WITHIN_S = 1.0
"""The journal is asked for this time what was answered before."""


MOST_OF_ONE = 50_000
"""Answers that are kept of one caller: those to its newest requests."""
COUNTED_EVERY = 1000
"""Requests of a caller after which that is seen to."""


def not_honoured() -> InvalidRequest:
    """A request relies on being carried out once, where the gateway does not see to that."""
    return InvalidRequest(
        "The header Idempotency-Key is not honoured here, for there is no journal, or the command comes "
        "as text, or its answer is secret: it would be carried out again; nothing was sent.",
        "Leave the header out, and look at what the first request did before you repeat it.",
    )


class RequestKey(NamedTuple):
    """A key, with the scope in which it stands for one request."""

    scope: str
    """The caller, and what it asks for."""
    key: str
    digest: str
    """Digest of all that distinguishes this request from others."""

    @property
    def caller(self) -> str:
        """The caller: the first word of the scope."""
        return self.scope.partition(" ")[0]

    @property
    def name(self) -> str:
        """The key under which the request's intents stand in the journal."""
        return f"{self.scope} {self.key}"

    def require_same(self, digest: str) -> None:
        """Refuse a key that stands for something else already.

        :raises InvalidRequest: it does.
        """
        if digest != self.digest:
            raise InvalidRequest(
                "The Idempotency-Key was used for another request before; nothing was sent.",
                "Give each request a key of its own, and repeat it only with the same content.",
            )


class KeptAnswer(NamedTuple):
    """The stored answer of an earlier request with the same Idempotency-Key."""

    status: int
    text: str


class LeftOpen(NamedTuple):
    """The gateway has ended before it answered, and this was begun."""

    moves: Sequence[MoveRecord]
    """Moves that the request began; None if it asked for something else, whose outcome is unknown."""
    among: str = ""
    """The resources that the first of them is among."""

    def begun(self) -> BegunMoves:
        """The moves, as they were to be told when they had begun."""
        first, *_ = its_own = [move for move in self.moves if type(move) is type(self.moves[0])]
        return BegunMoves(f"/{self.among}/{first.body_id}", its_own, getattr(first, "group_id", None))

    def unknown(self) -> NoReply:
        """The error for an interrupted request that was no move."""
        return NoReply(
            "The gateway has ended while this request was under way, and nobody knows what has become of it; "
            "nothing is sent again.",
            "Read back what it should have changed, then use another key.",
        )


class Keys:
    """The keys of a plant that has a journal."""

    def __init__(self, plant: Plant, journal: Journal) -> None:
        self._plant, self._journal = plant, journal
        self._begun: Counter[str] = Counter()
        """Requests that each caller has begun since the last count in the journal."""

    async def known(self, key: RequestKey) -> KeptAnswer | LeftOpen | None:
        """Find the outcome of an earlier request with this key; None where nothing was sent for it.

        :raises InvalidRequest: that was another request.
        :raises JournalUnavailable: the journal does not tell.
        """
        rows = await self._rows(
            "SELECT digest, status, answer FROM keys WHERE scope = ? AND key = ?", key.scope, key.key
        )
        for digest, status, text in rows:
            known = await self._left_open(key) if status is None else KeptAnswer(status, text)
            if known is not None:
                key.require_same(digest)
            return known
        return None

    async def _left_open(self, key: RequestKey) -> LeftOpen | None:
        rows = await self._rows("SELECT move_id FROM intents WHERE key = ? ORDER BY id", key.name)
        ids = dict.fromkeys(move_id for (ids,) in rows for move_id in (ids or "").split())
        moves = [found for move_id in ids if (found := self._move(move_id))]
        return LeftOpen([move for _, move in moves], *(among for among, _ in moves[:1])) if rows else None

    def place_of(self, path: str) -> str:
        """The path with the whole address in it: a body and a group have several, `3f`, `3F` and `arm.3F`."""
        kind, _, rest = path.removeprefix("/").partition("/")
        address, slash, what = rest.partition("/")
        with suppress(NotFound, Ambiguous, InvalidRequest):
            return f"{self._plant.target(f'/{kind}/{address}').path}/{what}" if slash else path
        return path

    def _move(self, move_id: str) -> tuple[str, MoveRecord] | None:
        for kind in self._plant.packages.registered:
            for moves in kind.move_logs():
                with suppress(NotFound):
                    return kind.collections[0], moves.get(move_id)
        return None

    def begin(self, key: RequestKey) -> None:
        """Write the key down: it is durable before the first intent of its request is.

        :raises JournalUnavailable: the journal cannot be written; nothing was sent.
        """
        self._journal.require()
        self._journal.note(writes.key_used(key.scope, key.key, key.digest, time.time()))
        self._begun[key.caller] += 1
        if self._begun[key.caller] >= COUNTED_EVERY:
            del self._begun[key.caller]
            self._journal.note(writes.keys_beyond(key.caller, MOST_OF_ONE))

    async def end(self, key: RequestKey, status: int, location: str | None, text: str) -> bool:
        """Keep what was answered, or free the key after a refusal of which nothing was sent; was it kept?"""
        kept = status < 400 or await self._was_sent(key)
        if kept:
            self._journal.note(writes.key_answered(key.scope, key.key, status, location, text))
        else:
            self._journal.note(writes.key_free(key.scope, key.key))
        return kept

    async def _was_sent(self, key: RequestKey) -> bool:
        """Say whether anything was sent for the key; if the journal cannot be read, it counts as sent."""
        sql = "SELECT 1 FROM intents WHERE key = ? AND written_at IS NOT NULL LIMIT 1"
        try:
            return bool(await self._rows(sql, key.name))
        except JournalUnavailable:
            return True

    async def _rows(self, sql: str, *values: Value) -> list[tuple[Any, ...]]:
        try:
            async with asyncio.timeout(ASKED_WITHIN_S):
                return await self._journal.rows(sql, *values)
        except TimeoutError:
            raise JournalUnavailable("it does not tell what was asked before") from None
