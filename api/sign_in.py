"""The page on which a person with a browser shows a key, or a code, once, and goes on with a session."""

from base64 import b64encode
from collections.abc import Mapping
from hashlib import sha256
from html import escape
from typing import Final
from urllib.parse import parse_qs, quote

from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, RedirectResponse, Response

from api.common.access import is_secure, session_cookie
from api.common.calling import read_body
from api.common.problems import SIGN_IN, wants_japanese
from api.common.requests import access_of, plant_of
from api.common.routes import PageRoute
from gateway.door.admission import PENDANT_S, Grant
from gateway.door.problems import words_of_page
from gateway.door.table import Right

SIGN_OUT: Final = "/sign-out"
PENDANT: Final = "/pendant"
MOST_BYTES: Final = 16_384
"""A form with a token of an OpenID provider is no longer."""
_AFTERWARDS: Final = "/"
_CONSOLE: Final = ("/", "./")
_NO_STORE: Final[Mapping[str, str]] = {"Cache-Control": "no-store"}
_FORM: Final = "application/x-www-form-urlencoded"


_STYLE: Final = (
    "body{font-family:sans-serif;max-width:28rem;margin:15vh auto;padding:0 1rem}"
    "input,button{font:inherit;padding:.5rem;width:100%;box-sizing:border-box;margin:.25rem 0 1rem}"
    "[role=alert]{color:#a00}"
)
_HEADERS: Final[Mapping[str, str]] = {
    "Content-Security-Policy": "default-src 'none'; style-src 'sha256-"
    f"{b64encode(sha256(_STYLE.encode()).digest()).decode()}'; form-action 'self'; base-uri 'none'; "
    "frame-ancestors 'none'",
    "X-Frame-Options": "DENY",
    # A browser sends `null` as the Origin of a form on a page without referrers.
    "Referrer-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Vary": "Accept-Language, Cookie",
}


def routes() -> list[PageRoute]:
    """The page, what it sends, and the way out."""
    return [
        PageRoute(SIGN_IN, _show, right=Right.OPEN),
        PageRoute(SIGN_IN, _sign_in, methods=["POST"], right=Right.OPEN),
        PageRoute(f"{SIGN_IN}/{{claim}}", _give_proof, methods=["POST"], right=Right.OPEN),
        PageRoute(PENDANT, _use_pendant, right=Right.OPEN),
        PageRoute(
            f"{PENDANT}/{{target}}", _lend_pendant, methods=["POST"], right=Right.OPERATE, any_scope=True
        ),
        PageRoute(SIGN_OUT, _sign_out, methods=["POST"], right=Right.VIEW, any_scope=True),
    ]


async def _show(request: Request) -> Response:
    return _page(request, request.query_params.get("next", ""))


async def _sign_in(request: Request) -> Response:
    access = access_of(request)
    form = parse_qs((await read_body(request, MOST_BYTES)).decode("utf-8", "replace"))
    content_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    shown = form.get("key", [""])[0].strip() if content_type == _FORM else ""
    following = form.get("next", [""])[0]
    grant = access.shown_at_sign_in(shown)
    if grant is None and not access.is_open:
        access.refuse_sign_in(SIGN_IN, _address(request))
        return _page(request, following, refusal="refused")
    place = quote(_local(following), safe="/?&=%")
    return RedirectResponse(place, 303) if grant is None else _begin(request, grant, place)


def _begin(request: Request, grant: Grant, place: str, headers: Mapping[str, str] | None = None) -> Response:
    """Begin a session, let the browser keep its id, and show a place; the console takes its second secret."""
    name, secure = session_cookie(request.scope), is_secure(request.scope)
    session = access_of(request).sign_in(grant, _address(request), request.cookies.get(name, ""))
    claim = f"?claim={access_of(request).claim_of(grant, session)}" if place in _CONSOLE else ""
    answer = RedirectResponse(f"{place}{claim}", 303, headers)
    answer.set_cookie(name, session, httponly=True, samesite="strict", secure=secure, path="/")
    return answer


async def _give_proof(request: Request) -> Response:
    """Give the console the second secret of the session that it has just begun, once."""
    session = request.cookies.get(session_cookie(request.scope), "")
    proof = access_of(request).claimed(str(request.path_params["claim"]), session)
    return JSONResponse({"proof": proof}, headers=_NO_STORE)


async def _lend_pendant(request: Request) -> Response:
    """Give the ticket that a phone begins its session with; it stands in a QR code of the console."""
    ticket = access_of(request).pendant_for(request.scope, str(request.path_params["target"]))
    told = {"ticket": ticket, "expires_in_s": PENDANT_S}
    return JSONResponse(told, headers=_NO_STORE)


async def _use_pendant(request: Request) -> Response:
    """Begin the session of a pendant. The browser keeps what stands behind #: which page to show."""
    access = access_of(request)
    grant = access.pendants.redeem(request.query_params.get("ticket", ""))
    if grant is None or not (access.is_open or access.holds(grant)):
        access.refuse_sign_in(PENDANT, _address(request))
        return _page(request, "", refusal="too-late")
    if access.is_open:
        return RedirectResponse("./", 303, _NO_STORE)
    return _begin(request, grant, "./", _NO_STORE)


def _address(request: Request) -> str:
    return request.client.host if request.client else ""


async def _sign_out(request: Request) -> Response:
    access = access_of(request)
    name = session_cookie(request.scope)
    access.sessions.end(request.cookies.get(name, ""))
    answer = RedirectResponse(SIGN_IN, 303)
    answer.delete_cookie(name, httponly=True, samesite="strict", secure=is_secure(request.scope), path="/")
    return answer


def _local(path: str) -> str:
    """A path of this gateway; a link to anywhere else is not followed."""
    good = path.startswith("/") and not path.startswith("//") and "\\" not in path and path.isprintable()
    return path if good else _AFTERWARDS


def _page(request: Request, following: str, *, refusal: str = "") -> Response:
    japanese = wants_japanese(request)
    words, language = words_of_page("sign-in", japanese=japanese), "ja" if japanese else "en"
    access = access_of(request)
    at = escape(plant_of(request).config.server.root_path)
    # A form without an action is sent to where it stands, and so keeps what stands behind # for afterwards.
    session = request.cookies.get(session_cookie(request.scope), "")
    refused = f"<p role=alert>{words[refusal]}</p>" if refusal else ""
    elsewhere = f' action="{at}{SIGN_IN}"' if request.url.path.endswith(PENDANT) else ""
    out = f'<form method="post" action="{at}{SIGN_OUT}"><button>{words["sign-out"]}</button></form>'
    content = (
        f'<!doctype html><html lang="{language}"><meta charset="utf-8"><title>{words["title"]}</title>'
        '<meta name="viewport" content="width=device-width">'
        f"<style>{_STYLE}</style><h1>{words['title']}</h1>"
        f"{refused}"
        f'<form method="post"{elsewhere}><label>{words["key"]}'
        '<input type="password" name="key" autocomplete="current-password" required autofocus></label>'
        f'<input type="hidden" name="next" value="{escape(_local(following))}">'
        f"<button>{words['sign-in']}</button></form>"
        f"{out if session and access.sessions.grant_of(session) else ''}<p>{words['note']}</p></html>"
    )
    return HTMLResponse(content, 401 if refusal else 200, {**_HEADERS, "Content-Language": language})
