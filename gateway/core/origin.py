"""Who asked, and by which request: every exchange carries it."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Origin:
    """The caller that an exchange is made for, and the request that made it."""

    caller: str
    request_id: str | None = None
    key: str | None = None
    """The Idempotency-Key that the request came with, within its scope."""


GATEWAY = Origin("gateway")
FENCE = Origin("gateway: fence")
PROBE = Origin("gateway: probe")
POLL = Origin("gateway: poll")
SET_UP = Origin("gateway: set-up")

_ORIGIN: ContextVar[Origin] = ContextVar("origin", default=GATEWAY)

current = _ORIGIN.get
"""The origin of what is asked here and now; a task keeps that of its beginning."""


@contextmanager
def acting(origin: Origin) -> Iterator[None]:
    """Give all exchanges that are made within this origin."""
    before = _ORIGIN.set(origin)
    try:
        yield
    finally:
        _ORIGIN.reset(before)
