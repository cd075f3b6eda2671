"""The header Idempotency-Key: refused where it is not honoured, for its sender relies on it and repeats."""

from typing import Final

from starlette.requests import HTTPConnection
from starlette.types import Scope

from api.front.stop_paths import is_stop
from gateway.door.keys import not_honoured
from gateway.door.table import Right

WITH_EFFECT: Final = frozenset({"POST", "PUT", "PATCH", "DELETE"})
"""Methods whose requests do something, most of them."""
READS: Final = frozenset({Right.OPEN, Right.VIEW})
"""The rights of routes that change nothing at a controller. Their requests may carry the header, unheeded."""
HEADER: Final = b"idempotency-key"
LONGEST_KEY: Final = 255
AS_TEXT: Final = "/raw"
"""A command as text may be a stop, which waits for no disk: its route refuses keys."""
SHOWN_ONCE: Final = "/access/keys"
"""A path whose answers are shown once, and so kept nowhere."""
HONOURED: Final = "motion-gateway.key-honoured"
"""Stands in the scope of a request whose key is seen to."""


def has_key(scope: Scope) -> bool:
    """Tell if a request has the header."""
    for name, _ in scope["headers"]:  # noqa: SIM110  # at each request: `any` would make a generator
        if name == HEADER:
            return True
    return False


def require_no_key(request: HTTPConnection) -> None:
    """Refuse a request that relies on being carried out once, where the gateway does not see to that.

    :raises InvalidRequest: it has the header.
    """
    if has_key(request.scope) and HONOURED not in request.scope:
        raise not_honoured()


def takes_key(method: str, path: str, right: Right | None) -> bool:
    """Tell if a request may rely on being carried out once: it changes something, and stops nothing.

    A read takes no key, by POST neither: the first answer again would be an old value told as one of now.
    """
    changes = method in WITH_EFFECT and right not in READS and not is_stop(method, path)
    return changes and not path.endswith((AS_TEXT, SHOWN_ONCE))
