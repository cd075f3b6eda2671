"""Queries of requests: a part that nobody knows is refused, for what was meant by it would not be done."""

from collections.abc import Collection

from starlette.requests import HTTPConnection

from gateway.errors import InvalidRequest


def require_known(request: HTTPConnection, known: Collection[str]) -> None:
    """Refuse a query with other parameters than the route has.

    :raises InvalidRequest: one has another name; the error says which there are.
    """
    if not request.scope["query_string"]:
        return
    for name in request.query_params:
        if name not in known:
            raise InvalidRequest(
                f"There is no query parameter {name[:40]!a} here, {_those(known)}; nothing was sent.",
                "See /docs for what can be asked.",
            )


def _those(known: Collection[str]) -> str:
    return f"only {', '.join(known)}" if known else "and no other"
