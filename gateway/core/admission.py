"""Admission of new work: none at the end of the gateway, and none that may be too old.

The event loop is watched for that: what has waited while it was held, or the whole process suspended, is
late.
"""

import asyncio
import time
from collections.abc import Callable
from functools import partial
from math import inf

from gateway.core.errors import GatewayEnding, HeldUp

BEAT_S = 0.05
LATE_BEAT_S = 0.02
"""A beat later than this counts as time in which the loop was held: what came meanwhile was not read."""
HELD_S = 0.25
"""A beat later than this is published."""
SUSPENDED_S = 2.0
"""Seconds by which a beat may be late; after a later one no earlier request is sent any more."""
DOUBT_S = 0.5
"""Seconds of doubt after a suspension.

Requests are read then that may have lain in their sockets all the time, so that their age is unknown; the
doubt lasts longer while the loop is late with what has piled up.
"""
LATE_S = 0.1

_CLOCK: int = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
boot_time: Callable[[], float] = partial(time.clock_gettime, _CLOCK)
"""Seconds on a clock that goes on while the computer sleeps: Linux and macOS call it differently."""


class LoopWatch:
    """A heart that beats in the loop. One that was never started notices nothing."""

    def __init__(self, clock: Callable[[], float] = boot_time) -> None:
        self.on_held: Callable[[float], None] = lambda _seconds: None
        """Called with the seconds for which the loop was held, from `HELD_S` on."""
        self._clock = clock
        self._due = inf
        """Time at which the next beat is due."""
        self._doubt_until = -inf
        self._beat_at = inf
        """Time at which the next beat is due, on the loop's own clock."""
        self._held_s = 0.0
        self._timer: asyncio.TimerHandle | None = None

    def start(self) -> None:
        """Begin to beat."""
        self._due = self._clock() + BEAT_S
        loop = asyncio.get_running_loop()
        self._beat_at = loop.time() + BEAT_S
        self._timer = loop.call_at(self._beat_at, self._beat)

    def close(self) -> None:
        """Beat no more."""
        if self._timer is not None:
            self._timer.cancel()
        self._due = self._beat_at = inf

    def held_s(self, now: float) -> float:
        """Seconds for which the loop was held since the start, until a time of its own clock.

        Nothing that came meanwhile was read: because of it no controller is silent, and no motor late.
        """
        late_s = now - self._beat_at
        return self._held_s + (late_s if late_s > LATE_BEAT_S else 0.0)

    def check_and_measure(self, now: float) -> float:
        """Notice a suspension now, and give what `held_s` does."""
        if self._clock() - self._due > SUSPENDED_S:
            self.check()
        late_s = now - self._beat_at
        return self._held_s + (late_s if late_s > LATE_BEAT_S else 0.0)

    def check(self) -> None:
        """Notice a suspension now: what is called first after it checks, before the next beat comes."""
        now = self._clock()
        late_s = now - self._due
        if late_s > SUSPENDED_S:
            self._due = now + BEAT_S
            self._notice(late_s, now)

    def in_doubt(self) -> bool:
        """Say whether the age of a request that comes now is unknown."""
        self.check()
        return self._clock() < self._doubt_until

    def _beat(self) -> None:
        now = self._clock()
        late_s = now - self._due
        self._held_s = self.held_s(asyncio.get_running_loop().time())
        self.start()
        if late_s > LATE_S and now < self._doubt_until:
            self._doubt_until = now + DOUBT_S
        if late_s > HELD_S:
            self._notice(late_s, now)

    def _notice(self, held_s: float, now: float) -> None:
        if held_s > SUSPENDED_S:
            self._doubt_until = now + DOUBT_S
        self.on_held(held_s)


class Admission:
    """Asked before whatever moves or changes something; reads and stops go without."""

    def __init__(self, watch: LoopWatch | None = None) -> None:
        self.watch = watch or LoopWatch()
        self._ended = False
        self.revise = self.watch.check
        """See that nothing is written that was admitted before a suspension."""
        self.revised = self.watch.check_and_measure
        """Do that, and give what `held_s` does."""
        self.held_s = self.watch.held_s
        """Seconds for which the event loop was held until now: in them no reply counts as late."""

    def require(self) -> None:
        """Refuse what comes too late.

        :raises ShuttingDown: the gateway ends.
        :raises HeldUp: it was suspended, and the request may have come meanwhile.
        """
        if self._ended:
            raise GatewayEnding
        if self.watch.in_doubt():
            raise HeldUp

    def end(self) -> None:
        """Let nothing begin any more."""
        self._ended = True
