"""Who is behind what goes over a line: a caller with a request, or the gateway itself."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


@dataclass(frozen=True)
class Origin:
    """Who acts, and because of which request."""

    caller: str
    """The interface and the address of a client, such as `http 127.0.0.1`; or `gateway: fence`."""
    request_id: str | None = None


_GATEWAY = Origin("gateway")
_current: ContextVar[Origin] = ContextVar("origin", default=_GATEWAY)


def current() -> Origin:
    """Tell on whose behalf the running code acts; tasks inherit it from those that begin them."""
    return _current.get()


@contextmanager
def acting(origin: Origin) -> Iterator[None]:
    """Act on behalf of somebody."""
    token = _current.set(origin)
    try:
        yield
    finally:
        _current.reset(token)
