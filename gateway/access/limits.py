"""Limits of each key, so that no client crowds out the others. Stops are never counted."""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from time import monotonic
from typing import Final

from gateway.access.errors import LimitReached

MOST_KNOWN: Final = 10_000
"""Keys and addresses whose use is counted at once."""


class Use(Enum):
    """A kind of use that is limited."""

    REQUEST = auto()
    MOVE = auto()
    SUBSCRIBER = auto()


@dataclass(frozen=True)
class KeyLimits:
    """The limits of one key."""

    subscribers: int = 50
    """Event streams at once."""
    requests: int = 200
    """Requests under way at once."""
    moves_per_s: int = 20
    """Requests that need the right to operate; as many may come together."""


@dataclass
class _Usage:
    room: float
    at: float
    requests: int = 0
    subscribers: int = 0

    def add(self, use: Use, number: int) -> None:
        """Count one more, or one less."""
        if use is Use.SUBSCRIBER:
            self.subscribers += number
        else:
            self.requests += number


class Usages:
    """Present use of each key."""

    def __init__(self, limits: KeyLimits, clock: Callable[[], float] = monotonic) -> None:
        self._limits = limits
        self._clock = clock
        self._of: dict[str, _Usage] = {}

    def begin(self, key: str, use: Use) -> None:
        """Count a request.

        :raises LimitReached: the key has as many already; nothing was sent.
        """
        usage = self._of.get(key)
        if usage is None:
            usage = self._of[key] = _Usage(self._limits.moves_per_s, self._clock())
        self._require_room(usage, use)
        usage.add(use, 1)

    def end(self, key: str, use: Use) -> None:
        """A request that was begun is over."""
        self._of[key].add(use, -1)

    def _require_room(self, usage: _Usage, use: Use) -> None:
        limits = self._limits
        if use is Use.SUBSCRIBER:
            if usage.subscribers >= limits.subscribers:
                raise _reached(f"{limits.subscribers} event streams")
            return
        if usage.requests >= limits.requests:
            raise _reached(f"{limits.requests} requests under way")
        if use is Use.MOVE:
            now = self._clock()
            grown = usage.room + (now - usage.at) * limits.moves_per_s
            usage.room, usage.at = min(float(limits.moves_per_s), grown), now
            if usage.room < 1:
                raise _reached(f"{limits.moves_per_s} moves in a second")
            usage.room -= 1


class Rates:
    """A rate limit for each caller: `at_once` calls together, and then `per_s` calls a second.

    A caller whose full allowance is back is forgotten, so that the rate bounds their number.
    """

    def __init__(self, at_once: int, per_s: float, clock: Callable[[], float] = monotonic) -> None:
        self._at_once, self._per_s, self._clock = at_once, per_s, clock
        self._full_at: OrderedDict[str, float] = OrderedDict()
        """Times at which callers have their full allowance again, the one let pass longest ago first."""

    def passes(self, name: str) -> bool:
        """Count one more; False where that is too many, and it does not count."""
        now = self._clock()
        while self._full_at and (
            next(iter(self._full_at.values())) <= now or len(self._full_at) > MOST_KNOWN
        ):
            self._full_at.popitem(last=False)
        full_at = max(self._full_at.get(name, now), now) + 1 / self._per_s
        if full_at - now > self._at_once / self._per_s:
            return False
        self._full_at[name] = full_at
        self._full_at.move_to_end(name)
        return True


def _reached(what: str) -> LimitReached:
    return LimitReached.worded("key.limit", what=what)
