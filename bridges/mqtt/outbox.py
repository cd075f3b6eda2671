"""What has to arrive at the broker, in order, over as many connections as it takes."""

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Final

MOST_WAITING: Final = 256
"""Messages that wait to be acknowledged; whoever has more to send waits, and the gateway keeps it."""
MOST_REPEATED: Final = 1000
REPEATED_S: Final = 5.0
"""What a broker has acknowledged it may still lose with its memory: so much is sent again after its fall."""


def _nothing() -> None:
    """Nobody is to be told."""


@dataclass(eq=False)
class Letter:
    """A message for the broker."""

    topic: str
    payload: bytes
    content_type: str
    correlation: bytes | None = None
    on_arrival: Callable[[], object] = _nothing
    """Called once it, and all before it, are acknowledged."""
    arrived: bool = False


Send = Callable[[Letter], Awaitable[None]]


class Outbox:
    """Letters in order. What a connection did not see acknowledged is sent again by the next one."""

    def __init__(self, most: int = MOST_WAITING) -> None:
        self._most = most
        self._letters: deque[Letter] = deque()
        self._next = 0
        """Of the letters, the first that the present connection has not sent."""
        self._recent: deque[tuple[float, Letter]] = deque(maxlen=MOST_REPEATED)
        """Those that have arrived of late, with the time."""
        self._changed = asyncio.Condition()

    def __len__(self) -> int:
        """How many wait."""
        return len(self._letters)

    async def put(self, letter: Letter) -> None:
        """Have a letter sent; waits while too many do."""
        async with self._changed:
            await self._changed.wait_for(lambda: len(self._letters) < self._most)
            self._letters.append(letter)
            self._changed.notify_all()

    async def empty(self) -> None:
        """Wait until all have arrived."""
        async with self._changed:
            await self._changed.wait_for(lambda: not self._letters)

    def repeat(self) -> None:
        """Have those sent again that have arrived of late: their broker may have fallen with them in hand."""
        since = _now() - REPEATED_S
        again = [letter for at, letter in self._recent if at >= since]
        self._recent.clear()
        self._letters.extendleft(reversed(again))

    async def deliver(self, send: Send) -> None:
        """Send what waits and what comes, many at a time, until the connection fails.

        :raises ExceptionGroup: what `send` has raised.
        """
        self._next = 0
        for (
            letter
        ) in self._letters:  # those after the first that is sent again follow it, so that order is kept
            letter.arrived = False
        async with asyncio.TaskGroup() as group:
            while True:
                async with self._changed:
                    await self._changed.wait_for(lambda: self._next < len(self._letters))
                    letter = self._letters[self._next]
                    self._next += 1
                group.create_task(self._send(letter, send))

    async def _send(self, letter: Letter, send: Send) -> None:
        await send(letter)
        letter.arrived = True
        async with self._changed:
            while self._letters and self._letters[0].arrived:
                first = self._letters.popleft()
                self._next -= 1
                self._recent.append((_now(), first))
                first.on_arrival()
                first.on_arrival = _nothing
            self._changed.notify_all()


def _now() -> float:
    return asyncio.get_running_loop().time()
