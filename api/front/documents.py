"""Documents that never change while the gateway runs: made once, packed once, and sent as they are."""

import asyncio
import gzip
import json
import re
from base64 import b64encode
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response

from api.common.routes import PageRoute
from api.front.swagger import DocumentPage, redoc_page, swagger_page
from gateway.door.table import Right

HTML = "text/html; charset=utf-8"
JSON = "application/json"

ASSETS_AT = "/static-offline-docs"
OPENAPI_AT = "/openapi.json"
RESOURCES_AT = "/openapi/resources.json"
CORE_AT = "/openapi/core.json"
_ASSETS: Final[Mapping[str, str]] = {
    "swagger-ui-bundle.js": "text/javascript; charset=utf-8",
    "swagger-ui.css": "text/css; charset=utf-8",
    "redoc.standalone.js": "text/javascript; charset=utf-8",
    "favicon.png": "image/png",
}
_PAGES: Final = (
    DocumentPage("/docs", "What is needed first", CORE_AT),
    DocumentPage("/docs/resources", "All resources", RESOURCES_AT),
    DocumentPage("/docs/all", "All resources and commands", OPENAPI_AT),
)
_NONE = "q=0"
_FOLDERS: Final = (Path(__file__).parent / "openapi", Path(__file__).parents[2] / "openapi")
"""The folders of the OpenAPI documents: in the installed package, or beside the sources."""
_WORTH_PACKING = 0.9
"""The share of its length below which gzip has to make a document, or it is sent as it is."""


@dataclass(frozen=True)
class MadeDocument:
    """The bytes of a document, plain and packed."""

    plain: bytes
    packed: bytes | None
    etag: str

    @classmethod
    def of(cls, content: bytes) -> "MadeDocument":
        """Pack a content, where that makes it shorter."""
        packed = gzip.compress(content, compresslevel=6, mtime=0)
        worth_it = len(packed) <= _WORTH_PACKING * len(content)
        return cls(content, packed if worth_it else None, sha256(content).hexdigest()[:32])


@dataclass(frozen=True)
class Document:
    """A document, made when it is first asked for."""

    media_type: str
    make: Callable[[], bytes]
    headers: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def made(self) -> MadeDocument:
        """Its bytes."""
        return MadeDocument.of(self.make())

    async def send(self, request: Request) -> Response:
        """Answer; when it is asked for first it is made in a thread, beside the event loop."""
        if "made" not in vars(self):
            await asyncio.to_thread(lambda: self.made)
        return self.answer(request)

    def answer(self, request: Request) -> Response:
        """Send it, or 304 to a client that has it; packed, if the client takes that."""
        made = self.made
        packed = made.packed if _takes_gzip(request.headers.get("accept-encoding", "")) else None
        etag = f'"{made.etag}-gzip"' if packed else f'"{made.etag}"'
        headers = {"ETag": etag, "Vary": "Accept-Encoding", "Cache-Control": "no-cache", **self.headers}
        if made.etag in _tags(request.headers.get("if-none-match", "")):
            return Response(status_code=304, headers=headers)
        if packed:
            headers["Content-Encoding"] = "gzip"
        return Response(packed or made.plain, headers=headers, media_type=self.media_type)


def _takes_gzip(accepted: str) -> bool:
    """Tell if Accept-Encoding has gzip, or everything, with another quality than 0 (RFC 9110 12.5.3)."""
    parts = (part.partition(";") for part in "".join(accepted.lower().split()).split(","))
    qualities = {name: quality for name, _, quality in parts}
    quality = qualities.get("gzip", qualities.get("*", _NONE))
    return not re.fullmatch(r"q=0(?:\.0*)?", quality)


def _tags(header: str) -> set[str]:
    """The tags of If-None-Match, of whichever encoding."""
    return {tag.removesuffix("-gzip") for tag in re.findall(r'"([^"]*)"', header)}


def page(make: Callable[[], HTMLResponse]) -> Document:
    """Make a document of a page that runs its own scripts, and nothing else from anywhere."""

    def policy() -> str:
        scripts = re.findall(rb"<script>(.*?)</script>", bytes(make().body), re.DOTALL)
        hashes = [f"'sha256-{b64encode(sha256(script).digest()).decode()}'" for script in scripts]
        return "; ".join([" ".join(["script-src 'self'", *hashes]), *_POLICY])

    return Document(HTML, lambda: bytes(make().body), {"Content-Security-Policy": policy(), **_OF_PAGES})


_POLICY: Final = (
    "default-src 'none'",
    "style-src 'self' 'unsafe-inline'",  # both pages set styles at their elements
    "img-src 'self' data:",
    "font-src 'self' data:",
    "connect-src 'self'",
    "worker-src blob:",  # ReDoc searches in a worker
    "base-uri 'none'",
    "form-action 'none'",
    "frame-ancestors 'none'",
)
_OF_PAGES: Final = {"X-Frame-Options": "DENY", "Referrer-Policy": "no-referrer"}


def install(app: Starlette, root_path: str = "") -> None:
    """Add the OpenAPI documents, the pages that show them, and what these load; all without internet.

    `root_path` is where a proxy has the gateway: the pages load from there.
    """
    documents = {
        OPENAPI_AT: Document(JSON, lambda: _written("openapi.json", root_path)),
        RESOURCES_AT: Document(JSON, lambda: _written("resources.json", root_path)),
        CORE_AT: Document(JSON, lambda: _written("core.json", root_path)),
        **{shown.at: _swagger(root_path, shown) for shown in _PAGES},
        "/redoc": page(lambda: redoc_page(root_path + OPENAPI_AT, root_path + ASSETS_AT)),
        **{f"{ASSETS_AT}/{name}": _asset(name, media_type) for name, media_type in _ASSETS.items()},
    }
    for path, document in documents.items():
        app.routes.append(PageRoute(path, document.send, right=Right.VIEW, any_scope=True))


def _written(name: str, root_path: str) -> bytes:
    """Read a document of `python -m api.openapi`: to describe all routes anew takes seconds at each start."""
    folder = next(folder for folder in _FOLDERS if folder.is_dir())
    text = b"".join([line.lstrip() for line in (folder / name).read_bytes().split(b"\n")])
    servers = b'"servers": %b,"paths": {' % json.dumps([{"url": root_path}]).encode()
    return text.replace(b'"paths": {', servers, 1) if root_path else text


def _swagger(root_path: str, shown: DocumentPage) -> Document:
    return page(lambda: swagger_page(shown, _PAGES, root_path, ASSETS_AT))


def _asset(name: str, media_type: str) -> Document:
    found = find_spec("fastapi_offline")  # to import it would import FastAPI
    assert found is not None  # noqa: S101  # it is installed with the gateway
    assert found.origin is not None  # noqa: S101  # as above
    return Document(media_type, (Path(found.origin).parent / "static" / name).read_bytes)
