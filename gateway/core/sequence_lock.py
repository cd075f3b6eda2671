"""Undivided series of commands: what depends on hidden state, or belongs together, is sent unbroken."""

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import AsyncExitStack, asynccontextmanager
from functools import partial

from gateway.core.errors import Expired
from gateway.core.exchange import SERIES, Lane, Series, require_room
from gateway.core.supervisor import insist

RELEASE = "the release of a sequence lock"


class SequenceLock:
    """A lock that goes to the confirmation of stops first, to commands before reads, and to each in turn.

    While it is held, the session of its target writes no command and no read of other holders; stops, their
    proofs, fences and the line's set-up never wait for it.

    Too many commands or reads are turned away. Questions that go before them are the gateway's own, to prove
    how a stop or a move ends: they are few, and never turned away.
    """

    def __init__(
        self, of: str = "robot", target: int = 0, holders: dict[int, Series | None] | None = None
    ) -> None:
        """`holders` are those of all locks of a line by target, which its scheduler looks at."""
        self._of, self._target = of, target
        self._holders = {} if holders is None else holders
        self._holders[target] = None
        self.on_free: Callable[[], None] = lambda: None
        """Called after each release: what had to wait for its holder may go."""
        self._waiting: dict[Lane, deque[asyncio.Future[None]]] = {lane: deque() for lane in Lane}

    @property
    def holder(self) -> Series | None:
        """The series that it is held for; None while it is free."""
        return self._holders[self._target]

    def waiting(self, lane: Lane) -> int:
        """Number of tasks that wait in a lane."""
        return len(self._waiting[lane])

    @asynccontextmanager
    async def held(
        self, lane: Lane = Lane.COMMAND, expires_at: float | None = None, *, series: Series | None = None
    ) -> AsyncIterator[Series]:
        """Hold it, as soon as it is free: all exchanges made within belong to one series.

        :raises QueueFull: too many wait already.
        :raises Expired: it was not free in time.
        """
        mine = series or Series()
        if self._holders[self._target] is not None:
            await self._wait(lane, expires_at)
        self._holders[self._target] = mine
        before = SERIES.set(mine)
        try:
            yield mine
        finally:
            SERIES.reset(before)
            insist(RELEASE, partial(self._release, mine), self.on_free)

    def _release(self, mine: Series | None) -> None:
        """Pass it on; once, though after a fault of the gateway itself it is tried again."""
        if mine is not None and self._holders[self._target] is mine:
            self._pass_on()

    async def _wait(self, lane: Lane, expires_at: float | None) -> None:
        queue = self._waiting[lane]
        if lane >= Lane.COMMAND:
            require_room(len(queue), self._of)
        turn: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        queue.append(turn)
        try:
            async with asyncio.timeout_at(expires_at):
                await turn
        except TimeoutError:
            self._give_up(turn, queue)
            raise Expired(self._of) from None
        except asyncio.CancelledError:
            self._give_up(turn, queue)
            raise

    def _give_up(self, turn: "asyncio.Future[None]", queue: "deque[asyncio.Future[None]]") -> None:
        if not turn.cancelled():
            insist(RELEASE, partial(self._release, self.holder), self.on_free)
        elif turn in queue:
            queue.remove(turn)

    def _pass_on(self) -> None:
        """Give the lock to the next waiter, which has it from this moment on."""
        for queue in self._waiting.values():
            while queue:
                turn = queue.popleft()
                if not turn.done():
                    self._holders[self._target] = Series()  # that of the next one, which has sent nothing yet
                    turn.set_result(None)
                    return
        self._holders[self._target] = None


@asynccontextmanager
async def all_held(locks: Iterable[SequenceLock], expires_at: float | None = None) -> AsyncIterator[Series]:
    """Hold several locks for one series. Give them in one order everywhere: two holders must not cross.

    :raises QueueFull, Expired: as of `SequenceLock.held`.
    """
    series = Series()
    async with AsyncExitStack() as stack:
        for lock in locks:
            await stack.enter_async_context(lock.held(expires_at=expires_at, series=series))
        yield series
