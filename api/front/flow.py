"""Both ways of a connection: whether it is read, and whether its client takes what is sent to it."""

import asyncio
from collections.abc import Callable
from functools import partial
from math import inf


class Timer:
    """One call that is due later, or none."""

    __slots__ = ("_handle",)

    def __init__(self) -> None:
        self._handle: asyncio.TimerHandle | None = None

    def start(self, seconds: float, then: Callable[[], object]) -> None:
        """Call `then` in a number of seconds, instead of what was due before."""
        self.cancel()
        self._handle = asyncio.get_running_loop().call_later(seconds, self._call, then)

    def _call(self, then: Callable[[], object]) -> None:
        self._handle = None
        then()

    def cancel(self) -> bool:
        """Call nothing; gives whether something was due."""
        was_due = self._handle is not None
        if self._handle is not None:
            self._handle.cancel()
            self._handle = None
        return was_due

    @property
    def is_due(self) -> bool:
        """True if a call is due."""
        return self._handle is not None


class RestTimer(Timer):
    """Ends a connection on which nothing is asked for; it goes on over the requests that come meanwhile."""

    __slots__ = ("_until",)

    def __init__(self) -> None:
        super().__init__()
        self._until = inf

    def begin(self, seconds: float, then: Callable[[], object]) -> None:
        """Call `then` after a number of seconds, if the rest has not ended before."""
        self._until = asyncio.get_running_loop().time() + seconds
        if not self.is_due:
            self.start(seconds, partial(self._look, then))

    def end(self) -> None:
        """Call nothing before the next rest is over."""
        self._until = inf

    def _look(self, then: Callable[[], object]) -> None:
        left_s = self._until - asyncio.get_running_loop().time()
        if left_s <= 0:
            then()
        elif left_s < inf:
            self.start(left_s, partial(self._look, then))


class Flow:
    """Reads a transport unless there is enough, and aborts it where its client takes nothing for long.

    A transport that is closed waits for ever until its peer has taken everything.
    """

    def __init__(self, transport: asyncio.Transport, seconds: float) -> None:
        self._transport = transport
        self._seconds = seconds
        self._timer = Timer()
        self._left = 0
        self.room: asyncio.Event | None = None
        """Set when there is room for more of an answer; None: there is."""
        self.held = self._paused = False
        """True if there is enough to parse; true if the transport does not read."""

    # what comes in

    def read(self, *, enough: bool = False) -> None:
        """Read on, unless it is held or there is `enough`."""
        paused = self.held or enough
        if paused != self._paused and not self._transport.is_closing():
            self._paused = paused
            (self._transport.pause_reading if paused else self._transport.resume_reading)()

    # what goes out

    def pause(self) -> None:
        """The client does not take what it is sent as fast as it comes."""
        self.room = self.room or asyncio.Event()
        self.watch()

    def resume(self) -> None:
        """It has taken most of it, or has left."""
        if self.room is not None:
            self.room.set()
            self.room = None
        self.stop()

    def watch(self) -> None:
        """Begin to look; nothing changes where that has begun."""
        if not self._timer.is_due:
            self._left = self._transport.get_write_buffer_size()
            self._timer.start(self._seconds, self._look)

    def stop(self) -> None:
        """Look no more."""
        self._timer.cancel()

    def _look(self) -> None:
        left = self._transport.get_write_buffer_size()
        if left >= self._left and (left or self._transport.is_closing()):
            self._transport.abort()
        elif left or self._transport.is_closing():
            self.watch()
