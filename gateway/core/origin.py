"""The caller and the request that an exchange comes from, and ids of requests, moves and records."""

import os
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from datetime import datetime
from random import Random
from secrets import randbits
from typing import Final, Literal

from gateway.core.parts import Part

_DIGITS: Final = Random(randbits(256))  # noqa: S311  # to ask the system at each request costs ten times as long
os.register_at_fork(after_in_child=lambda: _DIGITS.seed(randbits(256)))


def hex_digits(count: int) -> str:
    """Draw `count` digits."""
    return f"{_DIGITS.getrandbits(4 * count):0{count}x}"


class _ByTime:
    """Ids that sort in the order in which they are drawn, whatever becomes of the clock."""

    def __init__(self) -> None:
        self._last = 0

    def draw(self, at_ms: int) -> str:
        """An id for what happens at a time of the wall clock, in milliseconds."""
        self._last = max(at_ms << 32 | _DIGITS.getrandbits(32), self._last + 1)
        return f"{self._last:020x}"

    def go_on_after(self, drawn: str) -> None:
        """Draw none that sorts before this one of an earlier life, whose clock may have been ahead."""
        self._last = max(self._last, int(drawn, 16))


_BY_TIME: Final = _ByTime()
sorted_by_time: Final = _BY_TIME.draw
"""Draws an id for a time of the wall clock, in milliseconds: ids sort by it."""
go_on_after: Final = _BY_TIME.go_on_after


def new_id(now: datetime) -> str:
    """Draw an id for something that begins now."""
    return sorted_by_time(int(now.timestamp() * 1000))


Work = Literal["clients", "followers", "health", "probes", "fences", "stops", "set_up", "live"]
"""Purpose of a line's time: `followers` see moves to their ends, `stops` are seen to standstill."""


@dataclass(frozen=True, slots=True)
class Claim:
    """The leases a request shows, and what it was admitted to move or set."""

    tokens: tuple[int, ...] = ()
    parts: tuple[Part, ...] = ()
    holder: str = ""
    """Holder of the lease: a token can be guessed, so it is good for its lease's holder alone."""
    owner_epoch: int | None = None
    """Epoch of the line since which the sender believes that this gateway has it."""


NO_CLAIM = Claim()


@dataclass(frozen=True, slots=True)
class Origin:
    """The caller that an exchange is made for, and the request that made it."""

    caller: str
    request_id: str | None = None
    key: str | None = None
    """The Idempotency-Key that the request came with, within its scope."""
    work: Work = field(default="clients", compare=False)
    claim: Claim = field(default=NO_CLAIM, compare=False)
    """Claim that the write gate checks again."""
    address: str = field(default="", compare=False)
    """The network address of the client; empty where the request came from none."""

    def claiming(self, claim: Claim) -> "Origin":
        """Give this origin with another claim: `replace` takes three times as long, at every request."""
        return Origin(self.caller, self.request_id, self.key, self.work, claim, self.address)


GATEWAY = Origin("gateway", work="health")
FENCE = Origin("gateway: fence", work="fences")
PROBE = Origin("gateway: probe", work="probes")
POLL = Origin("gateway: poll", work="health")
SET_UP = Origin("gateway: set-up", work="set_up")
LIVE = Origin("gateway: live", work="live")
QUESTIONS: Final = frozenset(origin.caller for origin in (FENCE, PROBE, POLL, SET_UP, LIVE))
"""Callers of what the gateway asks by itself to know how things are; never of a stop."""
RESTART = Origin("gateway: restart")
"""Origin of work that goes on from an earlier life of the gateway."""

ORIGIN: ContextVar[Origin] = ContextVar("origin", default=GATEWAY)

current = ORIGIN.get
"""The origin of what is asked here and now; a task keeps that of its beginning."""


def new_request_id() -> str:
    """Name a request whose sender does not; as long as the id of a trace."""
    return hex_digits(32)


@contextmanager
def acting(origin: Origin) -> Iterator[None]:
    """Give all exchanges that are made within this origin."""
    before = ORIGIN.set(origin)
    try:
        yield
    finally:
        ORIGIN.reset(before)


def working(work: Work) -> AbstractContextManager[None]:
    """Let what is asked here be taken for this work, for every caller."""
    return acting(replace(current(), work=work))
