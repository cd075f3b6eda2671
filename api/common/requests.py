"""The common parts of routes: the plant behind them, the names in their paths, and how long they wait."""

import re
from collections.abc import Mapping
from typing import Protocol

from fastapi import Request, Response
from pydantic import BaseModel
from pydantic_core import to_json
from starlette.requests import HTTPConnection
from starlette.types import Receive, Scope, Send

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
    """The check of what the app lets in."""
    access: Access = request.scope["app"].access
    return access


def wait_s(request: Request, wait: float | None) -> float:
    """The seconds that the client wants to wait: by the query, else by `Prefer` (RFC 7240)."""
    if wait is None:
        match = _WAIT.search(",".join(request.headers.getlist("prefer")))
        wait = float(match[1]) if match else 0.0
    return min(wait, float(MAX_WAIT_S))


def wait_headers(waited_s: float) -> dict[str, str]:
    """Tell the client for how long its wish to wait was granted (RFC 7240)."""
    return {"Preference-Applied": f"wait={waited_s:g}"} if waited_s else {}


class JsonResponse(Response):
    """JSON that is written already. Starlette's response finds out more of itself than there is to find."""

    def __init__(
        self, content: str | bytes, status: int = 200, headers: Mapping[str, str] | None = None
    ) -> None:
        self.status_code, self.background = status, None
        self.body = content.encode() if isinstance(content, str) else content
        length = b"%d" % len(self.body)
        self.raw_headers = [
            *(
                (name.lower().encode("latin-1"), value.encode("latin-1"))
                for name, value in (headers or {}).items()
            ),
            (b"content-length", length),
            (b"content-type", b"application/json"),
        ]

    async def __call__(self, _scope: Scope, _receive: Receive, send: Send) -> None:
        """Send it."""
        head = {"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers}
        await send(head)
        await send({"type": "http.response.body", "body": self.body})


def json_response(model: BaseModel, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Answer with a model; it was validated when it was made."""
    return JsonResponse(model.model_dump_json(), status, headers)


class LongWork(Protocol):
    """The record of work that takes long."""

    @property
    def id(self) -> str:
        """The id that it is found again by."""

    @property
    def status(self) -> str:
        """`running` until it is over."""

    def model_dump_json(self) -> str:
        """Write it as JSON."""


def begun_response(work: LongWork, place: str, waited_s: float) -> Response:
    """Answer with work that has begun, kept at `place`: 202 while it runs, 200 when it is over."""
    status = 202 if work.status == "running" else 200
    headers = {"Location": f"{place}/{work.id}", **wait_headers(waited_s)}
    return JsonResponse(work.model_dump_json(), status, headers)


def content_response(
    content: object, status: int = 200, headers: Mapping[str, str] | None = None
) -> Response:
    """Answer with what the gateway itself has made, which needs no validation."""
    return JsonResponse(to_json(content), status, headers)
