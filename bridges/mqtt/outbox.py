"""Messages that have to arrive at the broker in order, over as many connections as it takes."""

import asyncio
import logging
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from math import inf
from typing import Final

log = logging.getLogger(__name__)

MOST_WAITING: Final = 256
"""Most letters without an acknowledgement; further senders wait, and the gateway keeps their events."""
MOST_KEPT: Final = 1000
MOST_TRIES: Final = 5
"""Connections on which an answer is sent; a broker may end each of them because of that very answer."""
KEPT_S: Final = 5.0
"""Seconds for which an acknowledged message may be sent again: a broker that crashes loses its memory."""


def _nothing() -> None:
    """Do nothing: the sender of this letter needs no call once it is settled."""


@dataclass(eq=False)
class Letter:
    """A message for the broker."""

    topic: str
    payload: bytes
    content_type: str
    correlation: bytes | None = None
    on_settled: Callable[[], object] = _nothing
    """Called when it, and all before it, have been at the broker for a while."""
    arrived: bool = False
    tries: int = 0


Send = Callable[[Letter], Awaitable[None]]


class Outbox:
    """Letters in order. Each connection begins with what the one before may not have brought to everybody.

    That is what was not acknowledged, and what was acknowledged of late: a broker that falls loses what it
    has not handed on yet.
    """

    def __init__(
        self,
        most: int = MOST_WAITING,
        *,
        kept_s: float = KEPT_S,
        at_once: float = inf,
        most_tries: float = inf,
        on_arrival: Callable[[], object] = _nothing,
    ) -> None:
        self._most, self._kept_s, self._at_once = most, kept_s, at_once
        self._most_tries, self._on_arrival = most_tries, on_arrival
        self._letters: deque[Letter] = deque()
        self._next = 0
        """Index of the first letter that the present connection has not sent."""
        self._kept: deque[tuple[float, Letter]] = deque()
        """Acknowledged letters, each with the time of its acknowledgement (monotonic, s)."""
        self._changed = asyncio.Condition()

    def __len__(self) -> int:
        """Give the number of letters without an acknowledgement."""
        return len(self._letters)

    async def put(self, letter: Letter) -> None:
        """Have a letter sent; waits while too many do."""
        async with self._changed:
            await self._changed.wait_for(lambda: len(self._letters) < self._most)
            self._letters.append(letter)
            self._changed.notify_all()

    async def empty(self) -> None:
        """Wait until all are acknowledged."""
        async with self._changed:
            await self._changed.wait_for(lambda: not self._letters)

    async def deliver(self, send: Send) -> None:
        """Send what waits and what comes, many at a time, until the connection fails.

        :raises ExceptionGroup: what `send` has raised.
        """
        self._letters.extendleft(letter for _, letter in reversed(self._kept))
        self._kept.clear()
        self._drop_refused()
        self._next = 0
        for letter in self._letters:  # all are sent again, so that they keep their order
            letter.arrived = False
        async with asyncio.TaskGroup() as group:
            while True:
                async with self._changed:
                    await self._changed.wait_for(lambda: self._next < min(len(self._letters), self._at_once))
                    letter = self._letters[self._next]
                    self._next += 1
                group.create_task(self._send(letter, send))

    def _drop_refused(self) -> None:
        for letter in [letter for letter in self._letters if letter.tries >= self._most_tries]:
            log.warning("no broker takes a message for %s: it is left out", letter.topic)
            self._letters.remove(letter)

    def settle(self) -> None:
        """Let go of what has been at the broker for long enough."""
        until = _now() - self._kept_s
        while self._kept and (self._kept[0][0] <= until or len(self._kept) > MOST_KEPT):
            self._kept.popleft()[1].on_settled()

    async def _send(self, letter: Letter, send: Send) -> None:
        letter.tries += 1
        await send(letter)
        letter.arrived = True
        self._on_arrival()
        async with self._changed:
            while self._letters and self._letters[0].arrived:
                self._kept.append((_now(), self._letters.popleft()))
                self._next -= 1
            self._changed.notify_all()
        self.settle()


def _now() -> float:
    return asyncio.get_running_loop().time()
