"""The documents as a site, served at `/manual/`; `make site` builds it from the folder `docs`."""

import re
from base64 import b64encode
from collections.abc import Iterator
from hashlib import sha256
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import PurePath
from typing import Final

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from api.common.routes import PageRoute
from api.front.documents import HTML, JSON, Document
from gateway.door.table import Right

BUILT: Final = files("api.manual") / "built"
AT: Final = "/manual"
FIRST: Final = "index.html"
_MEDIA_TYPES: Final = {
    ".html": HTML,
    ".json": JSON,
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".png": "image/png",
}
_POLICY: Final = (
    "default-src 'none'; script-src 'self'{}; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "connect-src 'self'; worker-src 'self' blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_INLINE: Final = re.compile(rb"<script>(.*?)</script>", re.DOTALL)


def install(app: Starlette) -> None:
    """Add the site, which loads nothing from elsewhere; where it was not built it says how that is done."""
    pages = dict(_pages(BUILT, ""))

    async def begin(request: Request) -> Response:
        return RedirectResponse(f"{request.scope.get('root_path', '')}{AT}/", 308)

    async def show(request: Request) -> Response:
        if not pages:
            raise HTTPException(
                404, "The manual was not built: `make site` builds it, and docs/ has its text."
            )
        page = pages.get(request.path_params["name"] or FIRST)
        if page is None:
            raise HTTPException(404)
        return await page.send(request)

    app.routes.append(PageRoute(AT, begin, right=Right.VIEW, any_scope=True))
    app.routes.append(PageRoute(f"{AT}/{{name:path}}", show, right=Right.VIEW, any_scope=True))


def _pages(folder: Traversable, place: str) -> Iterator[tuple[str, Document]]:
    for file in folder.iterdir() if folder.is_dir() else ():
        if file.is_dir():
            yield from _pages(file, f"{place}{file.name}/")
        elif (media_type := _MEDIA_TYPES.get(PurePath(file.name).suffix)) is not None:
            headers = {"X-Frame-Options": "DENY", "Referrer-Policy": "same-origin"}
            if media_type == HTML:
                headers["Content-Security-Policy"] = _POLICY.format(_hashes(file.read_bytes()))
            yield f"{place}{file.name}", Document(media_type, file.read_bytes, headers)


def _hashes(page: bytes) -> str:
    """The scripts within a page, by which the policy lets them run and no others."""
    found = (b64encode(sha256(script).digest()).decode() for script in _INLINE.findall(page))
    return "".join(f" 'sha256-{digest}'" for digest in found)
