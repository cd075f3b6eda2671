"""Who may speak to a robot now: its selected unit is hidden, so what depends on it is said unbroken."""

import asyncio
from collections import deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from gateway.core.errors import Expired, QueueFull
from gateway.core.lanes import QUEUE_LIMIT, Lane


class Floor:
    """A lock that goes to the confirmation of stops first, to commands before reads, and to each in turn.

    Too many commands or reads are turned away. What goes before them the gateway asks for itself, to prove
    how a stop or a move ends: of that there is little, and it is never turned away.
    """

    def __init__(self) -> None:
        self._taken = False
        self._waiting: dict[Lane, deque[asyncio.Future[None]]] = {lane: deque() for lane in Lane}

    def waiting(self, lane: Lane) -> int:
        """How many wait in a lane."""
        return len(self._waiting[lane])

    @asynccontextmanager
    async def held(self, lane: Lane = Lane.COMMAND, expires_at: float | None = None) -> AsyncIterator[None]:
        """Hold the floor, as soon as it is free.

        :raises QueueFull: too many wait already.
        :raises Expired: it was not free in time.
        """
        if self._taken:
            await self._wait(lane, expires_at)
        self._taken = True
        try:
            yield
        finally:
            self._pass_on()

    async def _wait(self, lane: Lane, expires_at: float | None) -> None:
        queue = self._waiting[lane]
        if lane >= Lane.COMMAND and len(queue) >= QUEUE_LIMIT:
            raise QueueFull(
                f"{QUEUE_LIMIT} requests wait for this robot already; nothing was sent.", "Try again later."
            )
        turn: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        queue.append(turn)
        try:
            async with asyncio.timeout_at(expires_at):
                await turn
        except TimeoutError:
            self._give_up(turn, queue)
            raise Expired("robot") from None
        except asyncio.CancelledError:
            self._give_up(turn, queue)
            raise

    def _give_up(self, turn: "asyncio.Future[None]", queue: "deque[asyncio.Future[None]]") -> None:
        if not turn.cancelled():
            self._pass_on()
        elif turn in queue:
            queue.remove(turn)

    def _pass_on(self) -> None:
        """Give the floor to the next, who holds it from this moment on."""
        for queue in self._waiting.values():
            while queue:
                turn = queue.popleft()
                if not turn.done():
                    turn.set_result(None)
                    return
        self._taken = False
