"""The header Idempotency-Key: refused until it is honoured, for its sender relies on it and repeats."""

from typing import Final

from starlette.requests import HTTPConnection

from gateway.core.errors import InvalidRequest

WITH_EFFECT: Final = frozenset({"POST", "PUT", "PATCH", "DELETE"})
"""Methods whose requests do something. Reads may carry the header."""


def require_no_key(request: HTTPConnection) -> None:
    """Refuse a request that relies on being carried out once, however often it is sent.

    :raises InvalidRequest: it has the header.
    """
    if "idempotency-key" in request.headers:
        raise InvalidRequest(
            "The gateway does not honour the header Idempotency-Key: a repeated request would be carried out "
            "again; nothing was sent.",
            "Leave the header out, and look at what the first request did before you repeat it.",
        )
