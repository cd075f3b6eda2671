"""Every error as a problem detail (RFC 9457), and its HTTP status.

Clients repeat 408, 425, 429, 500, 502, 503 and 504 by themselves: so 503 is sent only where nothing was
written to the line and nothing will be. A request that may have reached a controller is answered 409, and
`moved` says more.
"""

import logging
from collections.abc import Awaitable, Callable, Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from functools import partial
from http import HTTPStatus
from typing import Any, Final
from urllib.parse import quote, urlencode

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import BaseRoute, WebSocketRoute
from starlette.types import Scope

from api.common.faults import InvalidParts, faults_of
from api.front.stop_paths import is_stop
from gateway.door.caller import current
from gateway.door.problems import (
    TYPE_PREFIX,
    Ambiguous,
    CookieAlone,
    GatewayError,
    InvalidField,
    InvalidRequest,
    NextCall,
    NotAuthenticated,
    Problem,
    how_to_stop,
    problem_of,
    put_in_japanese,
)
from protocols.wording import MOST_SHOWN

log = logging.getLogger(__name__)

MEDIA_TYPE = "application/problem+json"
RETRY_AFTER_S = 1
CALLER: Final = "motion-gateway.caller"
"""Stands in the scope of a request whose sender has shown a good key: the key's name, and its address."""
SIGN_IN: Final = "/sign-in"
"""The page that takes the key of a person with a browser."""


def response_to(problem: Problem, headers: Mapping[str, str] | None = None) -> Response:
    """Send a problem."""
    return Response(
        problem.model_dump_json(exclude_none=True), problem.status, headers, media_type=MEDIA_TYPE
    )


def _refusal(request: Request, problem: Problem, headers: Mapping[str, str] | None = None) -> Response:
    """Log a refusal, and send it; of senders without a good key there may be crowds: they are counted."""
    if is_stop("POST", path_of(request.scope)):
        _tell_how_to_stop(request, problem)
    if problem.status not in (401, 403) and not _is_counted(request, problem):
        log.info(
            "%s %s refused with %d %s: %s",
            request.scope.get("method"),
            problem.instance,
            problem.status,
            problem.type.removeprefix(TYPE_PREFIX),
            problem.detail,
            extra={
                "facts": {
                    "caller": request.scope.get(CALLER, current().caller),
                    "request_id": problem.request_id,
                }
            },
        )
    language = {"Content-Language": "ja"} if wants_japanese(request) else {}
    return response_to(problem, {"Vary": "Accept-Language", **language, **(headers or {})})


def _is_counted(request: Request, problem: Problem) -> bool:
    """Tell if the door of the application, where it has one, has counted the sender as unknown."""
    door = getattr(request.app, "access", None)
    return door is not None and bool(door.counts_unknown(request.scope, problem.detail))


def _tell_how_to_stop(request: Request, problem: Problem) -> None:
    """Say of a stop that is not sent as it stands what counts: nothing was stopped, and what stops."""
    misnamed = any(error.field in request.path_params for error in problem.errors or ())
    if problem.status == 404 or misnamed or problem.type == TYPE_PREFIX + Ambiguous.kind:
        detail, remedy = how_to_stop(f"{quote(request.scope.get('root_path', ''))}/stop", "all")
    elif problem.status in (400, 405, 413, 422):
        of = problem.instance.partition("/commands/")[0].removesuffix("/stop")
        detail, remedy = how_to_stop(f"{of}/stop", "one")
    else:
        return
    if wants_japanese(request):
        problem.detail, problem.remedy = f"{problem.detail}{detail.ja}", remedy.ja
    else:
        problem.detail, problem.remedy = f"{problem.detail} {detail.en}", remedy.en


def wants_japanese(request: Request) -> bool:
    """Tell if Accept-Language asks for Japanese first."""
    first = request.headers.get("accept-language", "").partition(",")[0]
    return first.partition(";")[0].strip().lower().partition("-")[0] == "ja"


def path_of(scope: Scope) -> str:
    """The path of a request at this gateway, without that at which a proxy has it."""
    path: str = scope["path"]
    prefix = scope.get("root_path", "")
    return path.removeprefix(prefix) if path == prefix or path.startswith(f"{prefix}/") else path


def instance_of(request: Request) -> str:
    """The path of a request, as it may stand in a URI."""
    return quote(request.scope["path"])


Remedies = Callable[[str, GatewayError], Sequence[NextCall]]
"""Gives the calls that help where a request for a path has failed."""


Telling = Callable[[Any, Any], Awaitable[Response]]
"""Makes of a request, or a WebSocket, and what went wrong with it an answer."""


def tellings(remedies: Remedies = lambda _path, error: error.next) -> Mapping[type[Exception], Telling]:
    """The functions that tell each kind of error as a problem."""
    return {
        GatewayError: partial(_tell_gateway_error, remedies),
        InvalidParts: _tell_invalid,
        HTTPException: _tell_http_error,
        Exception: _tell_fault,
    }


async def _tell_gateway_error(remedies: Remedies, request: Request, error: GatewayError) -> Response:
    if isinstance(error, NotAuthenticated) and not isinstance(error, CookieAlone) and _shows_pages(request):
        return RedirectResponse(f"{SIGN_IN}?{urlencode({'next': path_of(request.scope)})}", 303)
    calls = remedies(path_of(request.scope), error)
    problem = problem_of(error, instance_of(request), calls, japanese=wants_japanese(request))
    headers = {}
    if problem.status == 503:
        headers["Retry-After"] = str(RETRY_AFTER_S)
    if problem.status == 401:
        headers["WWW-Authenticate"] = 'Bearer realm="motion-gateway"'
    return _refusal(request, problem, headers)


def _shows_pages(request: Request) -> bool:
    """Tell if a person opens a page in a browser, and so can sign in."""
    head = request.scope["headers"]
    return (b"sec-fetch-mode", b"navigate") in head and request.scope.get("method") == "GET"


async def _tell_invalid(request: Request, error: InvalidParts) -> Response:
    faults = faults_of(error.errors, error.body, error.shape)
    place, said = next(iter(faults.items()))
    problem = _plain(request, 422, f"{place or 'The request body'}: {said}; nothing was sent.")
    problem.errors = [InvalidField(field=place, message=said) for place, said in faults.items()]
    return _refusal(request, problem)


async def _tell_http_error(request: Request, error: HTTPException) -> Response:
    details = {
        404: f"There is {_nothing(request)} at {instance_of(request)}{_meant_by(request)}; nothing was sent.",
        405: f"{request.scope.get('method')} is not possible at {instance_of(request)}; nothing was sent.",
    }
    detail = details.get(error.status_code, error.detail)
    return _refusal(request, _plain(request, error.status_code, detail), error.headers)


def _nothing(request: Request) -> str:
    return "no WebSocket" if request.scope["type"] == "websocket" else "nothing"


def _meant_by(request: Request) -> str:
    """Name the path, the part of one or the command that was meant by an unknown one."""
    if request.scope["type"] == "websocket":
        sockets = (route.path for route in request.app.routes if isinstance(route, WebSocketRoute))
        return f" (there is one at {' and at '.join(sockets)})"
    asked = path_of(request.scope).split("/")
    if whole := _ending_in(request.app.routes, asked[1:]):
        return f" (did you mean {' or '.join(whole)}?)"
    only = len(asked) - 1 if "commands" in asked else None
    for index, known in _known_parts(request.app.routes, asked).items():
        similar = get_close_matches(asked[index][:MOST_SHOWN], known, n=1)
        if similar and only in (None, index):
            return f" (did you mean {similar[0]}?)"
    return ""


def _ending_in(routes: Sequence[BaseRoute], asked: Sequence[str]) -> list[str]:
    """The paths whose end was asked for: `/moves/5` without the body."""
    ends = {path: path.split("/")[1:][-len(asked) :] for path in dict.fromkeys(_paths(routes))}
    return [path for path, end in ends.items() if end[0] == asked[0] and _fits(end, asked)]


def _paths(routes: Iterable[BaseRoute]) -> Iterator[str]:
    """The paths of routes, and of those within others."""
    for route in routes:
        if isinstance(path := getattr(route, "path", None), str):
            yield path
        yield from _paths(getattr(route, "routes", None) or ())


def _fits(parts: Sequence[str], asked: Sequence[str]) -> bool:
    return len(parts) == len(asked) and all(
        part == word or (part.startswith("{") and word) for part, word in zip(parts, asked, strict=True)
    )


def _known_parts(routes: Sequence[BaseRoute], asked: Sequence[str]) -> dict[int, set[str]]:
    """The parts that would make another path a known one, by their place in it."""
    known: dict[int, set[str]] = {}
    for path in _paths(routes):
        parts = path.split("/")
        if len(parts) != len(asked):
            continue
        wrong = [n for n, part in enumerate(parts) if part != asked[n] and not part.startswith("{")]
        if len(wrong) == 1:
            known.setdefault(wrong[0], set()).add(parts[wrong[0]])
    return known


async def _tell_fault(request: Request, _error: Exception) -> Response:
    detail = "The gateway itself has failed; the line's trace tells what was sent."
    problem = _plain(request, 500, detail)
    problem.moved = "unknown"
    problem.remedy = "Read the body's status and position, and report the fault."
    return response_to(problem)


PHRASES = {413: "Request Entity Too Large"}
"""Words in which versions of Python differ."""


def _plain(request: Request, status: int, detail: str) -> Problem:
    problem = plain_problem(status, detail, instance_of(request))
    if wants_japanese(request):
        put_in_japanese(problem)
    return problem


def plain_problem(status: int, detail: str, instance: str) -> Problem:
    """Describe an error that HTTP itself has a name for; nothing was sent to a controller."""
    title = InvalidRequest.title if status == 422 else PHRASES.get(status) or HTTPStatus(status).phrase
    kind = InvalidRequest.kind if status == 422 else title.lower().replace(" ", "-")
    return Problem(
        type=TYPE_PREFIX + kind,
        title=title,
        status=status,
        detail=detail,
        instance=instance,
        moved="no",
        remedy="See /docs for what can be asked.",
        retryable=False,
    )
