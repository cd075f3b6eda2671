"""Queries of requests: an unknown part is refused, for what was meant by it would not be done."""

from collections.abc import Collection

from starlette.requests import HTTPConnection

from gateway.door.problems import InvalidRequest
from protocols.wording import shown, unknown


def require_known(request: HTTPConnection, known: Collection[str]) -> None:
    """Refuse a query with other parameters than the route has.

    :raises InvalidRequest: one has another name; the error says which there are.
    """
    if not request.scope["query_string"]:
        return
    for name in request.query_params:
        if name not in known:
            raise InvalidRequest(
                f"There is no query parameter {shown(name)} here ({unknown(name, known)}); nothing was sent.",
                "See /docs for what can be asked.",
            )
