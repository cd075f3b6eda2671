"""What routes have in common: the plant behind them, the names in their paths, and how long they wait."""

import re
from collections.abc import Mapping
from typing import Protocol

from fastapi import Request, Response
from pydantic import BaseModel
from pydantic_core import to_json
from starlette.requests import HTTPConnection

from api.common.access import Access
from api.common.routes import HttpRoute, Router
from api.common.strict_json import StrictRoute
from gateway.door.opening import Plant
from gateway.door.table import MAX_WAIT_S

_WAIT = re.compile(r'(?:^|[,;])\s*wait\s*=\s*"?(\d{1,9}(?:\.\d+)?)"?\s*(?:$|[,;])', re.IGNORECASE)


def new_router(tag: str, route_class: type[HttpRoute] = StrictRoute) -> Router:
    """Make a router, for strict JSON if nothing else is said."""
    return Router(tag, route_class)


def plant_of(request: HTTPConnection) -> Plant:
    """The plant that the app serves."""
    plant: Plant = request.scope["app"].plant
    return plant


def access_of(request: HTTPConnection) -> Access:
    """What the app lets in."""
    access: Access = request.scope["app"].access
    return access


def wait_s(request: Request, wait: float | None) -> float:
    """How many seconds the client wants to wait: by the query, else by `Prefer` (RFC 7240)."""
    if wait is None:
        match = _WAIT.search(",".join(request.headers.getlist("prefer")))
        wait = float(match[1]) if match else 0.0
    return min(wait, float(MAX_WAIT_S))


def wait_headers(waited_s: float) -> dict[str, str]:
    """Tell the client for how long its wish to wait was granted (RFC 7240)."""
    return {"Preference-Applied": f"wait={waited_s:g}"} if waited_s else {}


def json_response(model: BaseModel, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Answer with a model; it was validated when it was made."""
    return Response(model.model_dump_json(), status, headers, media_type="application/json")


class LongWork(Protocol):
    """The record of work that takes long."""

    @property
    def id(self) -> str:
        """What it is found again by."""

    @property
    def status(self) -> str:
        """`running` until it is over."""

    def model_dump_json(self) -> str:
        """Write it as JSON."""


def begun_response(work: LongWork, place: str, waited_s: float) -> Response:
    """Answer with work that has begun, kept at `place`: 202 while it runs, 200 when it is over."""
    status = 202 if work.status == "running" else 200
    headers = {"Location": f"{place}/{work.id}", **wait_headers(waited_s)}
    return Response(work.model_dump_json(), status, headers, media_type="application/json")


def content_response(
    content: object, status: int = 200, headers: Mapping[str, str] | None = None
) -> Response:
    """Answer with what the gateway itself has made, which needs no validation."""
    return Response(to_json(content), status, headers, media_type="application/json")
