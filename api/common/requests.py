"""The common parts of requests: the plant behind them, what they know of it, and how long they wait."""

import re
from collections.abc import Callable
from typing import Final

from starlette.requests import HTTPConnection, Request

from api.common.access import Access
from gateway.door.opening import Plant
from gateway.door.problems import Outdated
from gateway.door.table import MAX_WAIT_S

IF_MATCH: Final = "If-Match"
_TAG: Final = re.compile(r'(?:W/)?"[^"]*"')
_WAIT: Final = re.compile(r'(?:^|[,;])\s*wait\s*=\s*"?(\d{1,9}(?:\.\d+)?)"?\s*(?:$|[,;])', re.IGNORECASE)


def plant_of(request: HTTPConnection) -> Plant:
    """The plant that the app serves."""
    plant: Plant = request.scope["app"].plant
    return plant


def access_of(request: HTTPConnection) -> Access:
    """The check of what the app lets in."""
    access: Access = request.scope["app"].access
    return access


def wait_s(request: Request, wait: float | None) -> float:
    """The seconds that the client wants to wait: by the query, else by `Prefer` (RFC 7240)."""
    if wait is None:
        match = _WAIT.search(",".join(request.headers.getlist("prefer")))
        wait = float(match[1]) if match else 0.0
    return min(wait, float(MAX_WAIT_S))


def matching(request: Request) -> Callable[[str], None] | None:
    """A check that refuses a document of another tag than `If-Match` names; None where any will do.

    A weak tag names none.
    """
    wanted = ",".join(request.headers.getlist(IF_MATCH)).strip()
    if wanted in ("", "*"):
        return None

    def require(tag: str) -> None:
        if f'"{tag}"' not in _TAG.findall(wanted):
            raise Outdated

    return require
