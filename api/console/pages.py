"""The built pages over HTTP: one document, which changes with each version, and files that never change."""

from collections.abc import Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import PurePath
from typing import Final

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from api.common.routes import PageRoute
from api.front.documents import HTML, Document
from gateway.door.table import Right

BUILT: Final = files("api.console") / "built"
_MEDIA_TYPES: Final = {
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}
_OF_PAGE: Final = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
    "connect-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'",
    "X-Frame-Options": "DENY",
    # A browser sends `null` as the Origin of a form on a page without referrers.
    "Referrer-Policy": "same-origin",
}
_OF_ASSETS: Final = {
    # Their names have the hash of their content.
    "Cache-Control": "public, max-age=31536000, immutable",
}


def install(app: Starlette) -> None:
    """Add the pages, which load nothing from elsewhere."""
    page = Document(HTML, (BUILT / "index.html").read_bytes, _OF_PAGE)
    assets = {file.name: _asset(file) for file in (BUILT / "assets").iterdir()}

    async def show_asset(request: Request) -> Response:
        return await _named(assets, request.path_params["name"]).send(request)

    app.routes.append(PageRoute("/", page.send, right=Right.VIEW, any_scope=True))
    app.routes.append(PageRoute("/assets/{name}", show_asset, right=Right.VIEW, any_scope=True))


def _asset(file: Traversable) -> Document:
    return Document(_MEDIA_TYPES[PurePath(file.name).suffix], file.read_bytes, _OF_ASSETS)


def _named(assets: Mapping[str, Document], name: str) -> Document:
    if name not in assets:
        raise HTTPException(404)
    return assets[name]
