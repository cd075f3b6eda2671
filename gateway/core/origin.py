"""The caller and the request that an exchange comes from: every exchange carries both."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from typing import Literal

from gateway.core.ids import hex_digits
from gateway.core.parts import Part

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
