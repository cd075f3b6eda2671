"""The pages of the plant process: signing in once, and the console of all gateways.

The process keeps no sessions, so that any number of processes serve the same browser: the cookie holds the
key itself, which pages cannot read and other sites cannot send.
"""

from html import escape
from importlib import resources
from typing import Final
from urllib.parse import parse_qs

from starlette.requests import HTTPConnection, Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.routing import Route

SIGN_IN: Final = "/sign-in"
SIGN_OUT: Final = "/sign-out"
_FILES: Final = {
    "plant.js": "text/javascript",
    "plant.css": "text/css",
}
_HEADERS: Final = {
    "Content-Security-Policy": "default-src 'self'; frame-ancestors 'none'; base-uri 'none'; "
    "form-action 'self'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",
    "Cache-Control": "no-store",
}
MOST_BYTES: Final = 16_384


def routes() -> list[Route]:
    """The pages."""
    return [
        Route("/", _console),
        Route("/pages/{name}", _file),
        Route(SIGN_IN, _show),
        Route(SIGN_IN, _sign_in, methods=["POST"]),
        Route(SIGN_OUT, _sign_out, methods=["POST"]),
    ]


def cookie_name(connection: HTTPConnection) -> str:
    """The cookie with the key; over TLS a name that no other host can set."""
    return "__Host-mg-plant" if _is_secure(connection) else "mg-plant"


def _is_secure(connection: HTTPConnection) -> bool:
    return connection.url.scheme in ("https", "wss")


def _here(request: Request, path: str) -> str:
    """Give a path of the plant, which may stand at a sub-path behind a proxy."""
    return f"{request.scope.get('root_path', '')}{path}"


def _page(name: str) -> str:
    return resources.files("fleet").joinpath("console", name).read_text("utf-8")


async def _console(request: Request) -> Response:
    if request.app.state.config.access.mode != "open" and not request.cookies.get(cookie_name(request)):
        return RedirectResponse(_here(request, SIGN_IN), 303)
    return HTMLResponse(_page("plant.html"), headers=_HEADERS)


async def _file(request: Request) -> Response:
    name = request.path_params["name"]
    if name not in _FILES:
        return Response(status_code=404)
    return Response(_page(name), media_type=_FILES[name], headers=_HEADERS)


async def _show(_request: Request) -> Response:
    return _sign_in_page("")


def _sign_in_page(refusal: str) -> Response:
    told = f'<p role="alert">{escape(refusal)}</p>' if refusal else ""
    return HTMLResponse(
        _page("sign-in.html").replace("<!--refusal-->", told), 401 if refusal else 200, _HEADERS
    )


async def _sign_in(request: Request) -> Response:
    """Take a key that a gateway takes, and let the browser keep it until it is closed."""
    from fleet.upstream import Caller
    from gateway.core.errors import GatewayError

    content = await request.body()
    key = parse_qs(content[:MOST_BYTES].decode("utf-8", "replace")).get("key", [""])[0].strip()
    if not key or not key.isascii() or not key.isprintable() or any(sign in key for sign in ' ",;\\'):
        return _sign_in_page("This is no key. キーではありません。")
    try:
        await request.app.state.front.callers.sight_of(Caller(f"Bearer {key}"))
    except GatewayError as error:
        return _sign_in_page(error.detail)
    answer = RedirectResponse(_here(request, "/"), 303)
    answer.set_cookie(
        cookie_name(request), key, httponly=True, samesite="strict", secure=_is_secure(request), path="/"
    )
    return answer


async def _sign_out(request: Request) -> Response:
    answer = RedirectResponse(_here(request, SIGN_IN), 303)
    answer.delete_cookie(
        cookie_name(request), httponly=True, samesite="strict", secure=_is_secure(request), path="/"
    )
    return answer
