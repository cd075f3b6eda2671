"""The common parts of requests: the plant behind them, and how long they wait."""

import re
from typing import Final

from starlette.requests import HTTPConnection, Request

from api.common.access import Access
from gateway.door.opening import Plant
from gateway.door.table import MAX_WAIT_S

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
