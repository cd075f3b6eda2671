"""HTTP interface of the plant process: the routes of a gateway, for all gateways together."""

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Sequence
from typing import Any, Final, Literal
from uuid import uuid4

import httpx
from prometheus_client import CONTENT_TYPE_LATEST
from pydantic import BaseModel, ConfigDict, ValidationError
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection, Request
from starlette.responses import JSONResponse, RedirectResponse, Response, StreamingResponse
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket

from api.common.problems import plain_problem, response_to
from api.common.security import SameSite
from fleet import cursors, pages
from fleet.addresses import outward, path_outward, place_of, tokens_for
from fleet.callers import Callers, Sight
from fleet.errors import GatewaysUnreached, GatewayUnreached, NameTaken
from fleet.feed import Feed, PlantEvent, Reader, SlowClient, Wanted
from fleet.filters import filter_of
from fleet.follower import Follower
from fleet.leases import PlantLeaseRequest, PlantLeases, Refusal
from fleet.merged import LISTS, Merged, Refused
from fleet.registry import Gateway, Registry
from fleet.settings import PlantConfig
from fleet.sockets import pass_on
from fleet.stop import Attempt, PlantStop
from fleet.tasks import end
from fleet.upstream import PASSED_ON, Caller, Upstream
from gateway.access.errors import NotAuthenticated
from gateway.core.errors import GatewayError, InvalidRequest, NotFound
from gateway.core.events import MAX_PAGE
from gateway.core.origin import Origin, acting
from gateway.door.problems import problem_of
from gateway.version import VERSION

KEEP_ALIVE_S: Final = 15.0
RECHECK_S: Final = 5.0
"""Seconds between checks that the key of an open event stream is still valid."""
CONTENT_S: Final = 10.0
"""A request's content is there by then, or the request is refused."""
MOST_BYTES: Final = 1_000_000
"""A request's content is no longer; a gateway takes no more either."""
CLOSE_GOING_AWAY, CLOSE_SLOW, CLOSE_REFUSED = 1001, 1013, 4401
_ALL: Final = ["GET", "POST", "PUT", "PATCH", "DELETE"]
_ANSWERED: Final = frozenset(
    {
        *("content-type", "content-language", "etag", "location", "preference-applied", "retry-after"),
        *("www-authenticate", "x-request-id", "cache-control", "content-disposition", "vary", "deprecation"),
        *("content-security-policy", "x-frame-options", "referrer-policy", "idempotency-replayed"),
    }
)
"""Headers of a gateway's answer that are passed on."""


AnswerOf = Callable[[str, httpx.Response], Response]
"""Makes the plant's answer of that of a gateway."""


class StopRequest(BaseModel):
    """How to stop."""

    model_config = ConfigDict(extra="forbid")

    mode: Literal["decelerate", "immediate"] = "decelerate"


class Front:
    """The routes, over the registry, the feed and the gateways."""

    def __init__(self, config: PlantConfig) -> None:
        self.registry = Registry(config.plant.gateways)
        self.feed = Feed()
        self.follower = Follower(config.plant, self.registry, self.feed)
        self.upstream = Upstream(self.registry, config.plant.ca)
        self.callers = Callers(self.registry, self.upstream, is_open=config.access.mode == "open")
        self.merged = Merged(self.registry, self.upstream)
        self.leases = PlantLeases(self.registry, self.upstream)
        self.stops = PlantStop(self.registry, self.upstream, self.follower)
        self._named = bool(config.plant.gateways)
        self._tasks: list[asyncio.Task[None]] = []

    def start(self) -> None:
        """Begin to follow the servers and the gateways."""
        work = self.follower.run(), self.upstream.keep_warm()
        self._tasks = [asyncio.create_task(part, name="plant") for part in work]

    async def aclose(self) -> None:
        """End everything."""
        self.feed.close()
        await end(self._tasks)
        await self.stops.aclose()
        await self.upstream.aclose()

    def routes(self) -> list[BaseRoute]:
        """All of them; what has a gateway's name in its path is passed on."""
        lists: list[BaseRoute] = [Route(f"/{what}", self._list, methods=["GET"], name=what) for what in LISTS]
        return [
            Route("/livez", _livez),
            Route("/readyz", self._readyz),
            Route("/version", _version),
            Route("/gateways", self._gateways),
            Route("/gateways/{gateway}", self._gateway),
            Route("/gateways/{gateway}/{path:path}", self._pass_to_gateway, methods=_ALL),
            WebSocketRoute("/gateways/{gateway}/{path:path}", self._join_gateway),
            Route("/leases", self._take_leases, methods=["POST"]),
            Route("/leases/{lease}", self._lease, methods=["GET", "DELETE"]),
            Route("/leases/{lease}/renew", self._lease, methods=["POST"]),
            *lists,
            Route("/system/identity", self._identity),
            Route("/metrics", self._metrics),
            Route("/events", self._list_events),
            Route("/events/stream", self._stream_events),
            WebSocketRoute("/events", self._follow_events),
            Route("/stop", self._stop, methods=["POST"]),
            *pages.routes(),
            Route("/{collection}/{path:path}", self._pass_on, methods=_ALL),
        ]

    # the gateways

    async def _readyz(self, _request: Request) -> Response:
        """Ready as soon as all that the stream has was read once; stops work without the servers, too."""
        gateways = self.registry.all()
        online = sum(map(self.registry.is_online, gateways))
        told = {
            "ready": (ready := self.follower.caught_up or self._named),
            "servers": "followed" if self.follower.trouble is None else "unreached",
            "gateways": {"online": online, "unheard": len(gateways) - online},
        }
        return JSONResponse(told, 200 if ready else 503)

    async def _gateways(self, request: Request) -> Response:
        await self.callers.sight_of(caller_of(request))
        return JSONResponse(
            {
                "gateways": [self.registry.told(gateway) for gateway in self.registry.all()],
                "servers": {"followed": self.follower.trouble is None, "trouble": self.follower.trouble},
            }
        )

    async def _gateway(self, request: Request) -> Response:
        await self.callers.sight_of(caller_of(request))
        return JSONResponse(self.registry.told(self._named_gateway(request.path_params["gateway"])))

    def _named_gateway(self, name: str) -> Gateway:
        found = self.registry.get(name)
        if found is None:
            known = ", ".join(gateway.name for gateway in self.registry.all()) or "none"
            raise NotFound(
                f"There is no gateway {name[:40]} in the plant (known: {known}); nothing was sent.",
                "GET /gateways lists those that were heard.",
            )
        return found

    # lists

    async def _list(self, request: Request) -> Response:
        caller = caller_of(request)
        self.callers.require_shown(caller)
        try:
            told = await self.merged.listed(request.url.path.rpartition("/")[2], request.url.query, caller)
        except Refused as refused:
            return _answer_as(refused.answer)
        return JSONResponse(told)

    async def _identity(self, request: Request) -> Response:
        """The first gateway that answers tells who asks."""
        caller = caller_of(request)
        self.callers.require_shown(caller)
        for gateway in sorted(self.registry.all(), key=lambda gateway: not self.registry.is_online(gateway)):
            try:
                return _answer_as(
                    await self.upstream.ask(gateway, "GET", "/system/identity", caller.headers, within_s=2.0)
                )
            except GatewayError:
                continue
        raise GatewayUnreached("No gateway of the plant is reached; nothing was sent.")

    async def _metrics(self, request: Request) -> Response:
        caller = caller_of(request)
        self.callers.require_shown(caller)
        try:
            return Response(await self.merged.metrics(caller), media_type=CONTENT_TYPE_LATEST)
        except Refused as refused:
            return _answer_as(refused.answer)

    # events

    async def _reader(self, connection: HTTPConnection, after: str | None) -> tuple[Reader, Wanted, Sight]:
        query = connection.query_params
        for name in query:
            if name not in ("after", "bodies", "types", "gateways", "limit"):
                raise InvalidRequest(f"{name}: there is no such part of the query.", _OF_EVENTS)
        wanted = filter_of(query.get("bodies"), query.get("types"), query.get("gateways"))
        sight = await self.callers.sight_of(caller_of(connection))
        places = None if after is None else cursors.read(after)
        return self.feed.reader(places, sight.within(wanted)), wanted, sight

    async def _list_events(self, request: Request) -> Response:
        """List what has happened after the plant's cursor, or from the oldest event that is kept."""
        limit = _limit_of(request.query_params.get("limit"))
        reader, _, _ = await self._reader(request, request.query_params.get("after", "-"))
        events: list[PlantEvent] = []
        while len(events) < limit:
            before = reader.cursor
            events += reader.take(limit - len(events))
            if reader.cursor == before:
                break
            await asyncio.sleep(0)
        told = ",".join(event.json for event in events)
        return Response(
            f'{{"events":[{told}],"cursor":{json.dumps(reader.cursor)}}}', media_type="application/json"
        )

    async def _stream_events(self, request: Request) -> Response:
        after = request.headers.get("last-event-id") or request.query_params.get("after")
        reader, _, _ = await self._reader(request, after)
        headers = {"Cache-Control": "no-cache", "X-Accel-Buffering": "no"}
        sent = self._server_sent(reader, caller_of(request))
        return StreamingResponse(sent, media_type="text/event-stream", headers=headers)

    async def _server_sent(self, reader: Reader, caller: Caller) -> AsyncIterator[str]:
        yield f": events after {reader.cursor}\n\n"
        async for events in self._batches(reader, caller):
            frames = [f"event: {event.type}\ndata: {event.json}\n\n" for event in events]
            if frames:  # a browser goes on after the id that came last
                frames[-1] = f"id: {reader.cursor}\n{frames[-1]}"
            yield "".join(frames) or ": still here\n\n"

    async def _batches(self, reader: Reader, caller: Caller) -> AsyncIterator[Sequence[PlantEvent]]:
        """Give events as they come, nothing where none have come for a while, until the key is no good."""
        loop = asyncio.get_running_loop()
        checked_at = told_at = loop.time()
        while not reader.is_over:
            try:
                async with asyncio.timeout(RECHECK_S):
                    events = await reader.next()
            except TimeoutError:
                events = []
            except SlowClient:
                return
            if loop.time() - checked_at >= RECHECK_S:
                checked_at = loop.time()
                try:
                    await self.callers.sight_of(caller)
                except GatewayError:
                    return
            if events or loop.time() - told_at >= KEEP_ALIVE_S:
                told_at = loop.time()
                yield events

    async def _follow_events(self, websocket: WebSocket) -> None:
        """Send events as they happen, a text frame each; what the client sends is not read."""
        await websocket.accept()
        try:
            reader, _, _ = await self._reader(websocket, websocket.query_params.get("after"))
        except GatewayError as error:
            await websocket.send_text(problem_of(error, "/events").model_dump_json(exclude_none=True))
            await websocket.close(CLOSE_REFUSED if isinstance(error, NotAuthenticated) else 1008, error.kind)
            return
        sending = asyncio.create_task(self._send(websocket, reader), name="event stream")
        hearing = asyncio.create_task(_until_closed(websocket), name="event stream")
        try:
            await asyncio.wait({sending, hearing}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in (sending, hearing):
                task.cancel()
            await asyncio.gather(sending, hearing, return_exceptions=True)

    async def _send(self, websocket: WebSocket, reader: Reader) -> None:
        async for events in self._batches(reader, caller_of(websocket)):
            for event in events:
                await websocket.send_text(event.json)
        code, why = (CLOSE_GOING_AWAY, "the plant process is shutting down")
        if not reader.is_over:
            code, why = CLOSE_SLOW, "slow, or the key is no good any more; go on after the last cursors"
        await websocket.close(code, why)

    # stops

    async def _stop(self, request: Request) -> Response:
        """Stop all gateways by both ways; 200 only where every controller of all reports standstill."""
        caller = caller_of(request)
        self.callers.require_shown(caller)
        content = await _content_of(request)
        try:
            mode = StopRequest.model_validate_json(content).mode if content else "decelerate"
        except ValidationError:
            raise InvalidRequest(
                "mode: it has to be decelerate or immediate; nothing was stopped.",
                'POST /stop without content, or with {"mode": "immediate"}, stops everything.',
            ) from None
        attempts = await self.stops.stop(caller, mode)
        return _told_stop(attempts, request)

    # leases

    async def _take_leases(self, request: Request) -> Response:
        caller = caller_of(request)
        self.callers.require_shown(caller)
        try:
            asked = PlantLeaseRequest.model_validate_json(await _content_of(request))
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"])) or "The request"
            raise InvalidRequest(f"{place}: {first['msg']}; nothing was leased.") from None
        try:
            told = await self.leases.take(asked, caller)
        except Refusal as refusal:
            return _answer_of(refusal.gateway, refusal.answer)
        return JSONResponse(told, 201, {"Location": f"/leases/{told['lease']}", "Cache-Control": "no-store"})

    async def _lease(self, request: Request) -> Response:
        caller = caller_of(request)
        self.callers.require_shown(caller)
        action = "renew" if request.method == "POST" else "DELETE" if request.method == "DELETE" else ""
        tokens = request.headers.get("lease-token", "")
        try:
            return JSONResponse(await self.leases.each(request.path_params["lease"], action, tokens, caller))
        except Refusal as refusal:
            return _answer_of(refusal.gateway, refusal.answer)

    # all else

    async def _pass_on(self, request: Request) -> Response:
        self.callers.require_shown(caller_of(request))
        asked = "/{collection}/{path}".format(**request.path_params)
        place = place_of(asked)
        if place is None:
            raise NotFound(
                f"There is nothing at {asked[:200]} in a plant; nothing was sent.",
                "Put a gateway's name in front of the address, /bodies/stocker1:line1.3F, or go through it: "
                "/gateways/stocker1/audit. POST /stop stops everything.",
            )
        return await self._pass(request, place.gateway, place.path, _answer_of)

    async def _pass_to_gateway(self, request: Request) -> Response:
        """Be the gateway itself: its console speaks of its own addresses."""
        self.callers.require_shown(caller_of(request))
        gateway, path = request.path_params["gateway"], request.path_params["path"]
        return await self._pass(request, gateway, f"/{path}", _own_answer_of)

    async def _join_gateway(self, websocket: WebSocket) -> None:
        caller = caller_of(websocket)
        try:
            self.callers.require_shown(caller)
            gateway = self._owner(websocket.path_params["gateway"])
        except GatewayError as error:
            await websocket.close(CLOSE_REFUSED, error.kind)
            return
        path = _quoted(f"/{websocket.path_params['path']}", websocket)
        protocols = websocket.scope["subprotocols"]
        await pass_on(websocket, self.upstream.open_socket(gateway, path, caller.headers, protocols))

    def _owner(self, name: str) -> Gateway:
        """Find the gateway that a command is for.

        :raises NotFound: there is none; nothing was sent.
        :raises NameTaken: there are two; nothing was sent.
        """
        gateway = self._named_gateway(name)
        if not self.registry.is_named(name) and (conflict := self.registry.conflict_of(name)):
            raise NameTaken(
                f"{conflict} Nothing was sent.", "Ask that gateway itself. POST /stop stops both."
            )
        return gateway

    async def _pass(self, request: Request, name: str, path: str, answer_of: AnswerOf) -> Response:
        """Ask the owner in the caller's name, and give what it answers."""
        gateway = self._owner(name)
        caller = caller_of(request)
        headers = {name: value for name, value in request.headers.items() if name in PASSED_ON}
        headers |= caller.headers
        if tokens := tokens_for(gateway.name, request.headers.get("lease-token", "")):
            headers["lease-token"] = tokens
        quoted = _quoted(path, request)
        is_stream = path.endswith("/stream")
        answer = await self.upstream.begin(
            gateway,
            request.method,
            quoted,
            headers,
            await _content_of(request),
            **({"within_s": None} if is_stream else {}),
        )
        if is_stream and answer.is_success:
            return StreamingResponse(_pieces(answer), answer.status_code, _headers_of(gateway.name, answer))
        try:
            await answer.aread()
        finally:
            await answer.aclose()
        return answer_of(gateway.name, answer)


_OF_EVENTS: Final = (
    "Give after, bodies, types, gateways or limit; live values (`sample`) are had from the gateway itself."
)


def create_app(front: Front, config: PlantConfig) -> ASGIApp:
    """Make the application."""
    app = Starlette(
        routes=front.routes(),
        exception_handlers={
            GatewayError: _tell_error,
            HTTPException: _tell_http_error,
            Exception: _tell_fault,
        },
    )
    app.router.redirect_slashes = False
    app.state.front = front
    app.state.config = config
    server = config.server
    return _Guarded(app, SameSite(server.names, server.allowed_origins, server.client_networks))


class _Guarded:
    """Refuses foreign pages and networks, and gives each request an id."""

    def __init__(self, app: ASGIApp, same_site: SameSite) -> None:
        self._app, self._same_site = app, same_site

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            return
        reason = self._same_site.reason_against(scope)
        if reason is not None and scope["type"] == "http":
            problem = plain_problem(403, f"{reason.detail} Nothing was sent.", scope["path"])
            problem.remedy = reason.remedy
            await response_to(problem)(scope, receive, send)
        elif reason is not None:
            await WebSocket(scope, receive, send).close(1008, reason.detail)
        else:
            given = dict(scope["headers"]).get(b"x-request-id", b"").decode("latin-1")
            scope["request_id"] = given if given.isalnum() and len(given) <= 64 else uuid4().hex
            with acting(Origin("plant", scope["request_id"])):
                await self._app(scope, receive, send)


def caller_of(connection: HTTPConnection) -> Caller:
    """Read the key of a request: from its head, or from the cookie of the sign-in page."""
    shown = connection.headers.get("authorization", "")
    if not shown and (key := connection.cookies.get(pages.cookie_name(connection))):
        shown = f"Bearer {key}"
    return Caller(shown, connection.headers.get("accept-language", ""), connection.scope["request_id"])


async def _until_closed(websocket: WebSocket) -> None:
    while (await websocket.receive())["type"] != "websocket.disconnect":
        pass


async def _content_of(request: Request) -> bytes:
    content = b""
    try:
        async with asyncio.timeout(CONTENT_S):
            async for piece in request.stream():
                content += piece
                if len(content) > MOST_BYTES:
                    raise HTTPException(413, "The content is larger than 1 MB; nothing was sent.")
    except TimeoutError:
        raise HTTPException(
            408, f"The content was not there within {CONTENT_S:.0f} s; nothing was sent."
        ) from None
    return content


def _quoted(path: str, connection: HTTPConnection) -> str:
    """Write a path with its query as a request has it.

    :raises InvalidRequest: it is none.
    """
    try:
        return httpx.URL(path=path, query=connection.url.query.encode()).raw_path.decode()
    except httpx.InvalidURL as error:
        raise InvalidRequest(f"{path[:80]!r} is no path: {error}; nothing was sent.") from None


def _limit_of(text: str | None) -> int:
    if text is None:
        return 100
    if not text.isdecimal() or not 1 <= int(text) <= MAX_PAGE:
        raise InvalidRequest(f"limit: {text[:20]!r} is no number from 1 to {MAX_PAGE}.")
    return int(text)


async def _livez(_request: Request) -> Response:
    return JSONResponse({"status": "alive"})


async def _version(_request: Request) -> Response:
    return JSONResponse({"name": "motion-gateway plant", "version": VERSION})


def _told_stop(attempts: Sequence[Attempt], request: Request) -> Response:
    """Tell how far the stop of the plant has come, in such a way that half a success reads as none."""
    told = [attempt.told() for attempt in attempts]
    reports = [attempt["report"] for attempt in told if attempt["report"] is not None]
    united = {
        "confirmed": bool(attempts) and all(attempt.state == "confirmed" for attempt in attempts),
        "bodies": [body for report in reports for body in report["bodies"]],
        "robots": [robot for report in reports for robot in report["robots"]],
        "gateways": told,
    }
    if united["confirmed"]:
        return JSONResponse(united)
    open_ones = [attempt.gateway for attempt in attempts if attempt.state != "confirmed"]
    detail = (
        f"The stop is not confirmed by {', '.join(open_ones)}; the attempt goes on for 60 s."
        if open_ones
        else "No gateway of the plant is known here: nothing was stopped."
    )
    error = GatewaysUnreached(detail, "Use the hardware stops of these machines. Then look at each gateway.")
    problem = problem_of(error, request.url.path).model_dump(mode="json", exclude_none=True)
    return JSONResponse({**problem, **united}, 409, media_type="application/problem+json")


def _headers_of(gateway: str, answer: httpx.Response) -> dict[str, str]:
    headers = {name: value for name, value in answer.headers.items() if name in _ANSWERED}
    if "location" in headers:
        headers["location"] = path_outward(gateway, headers["location"])
    return {**headers, "X-Gateway": gateway}


def _answer_of(gateway: str, answer: httpx.Response) -> Response:
    """Give a gateway's answer with the plant's addresses in it."""
    content, kind = answer.content, answer.headers.get("content-type", "")
    if content and kind.partition(";")[0] in ("application/json", "application/problem+json"):
        content = json.dumps(
            outward(gateway, answer.json()), ensure_ascii=False, separators=(",", ":")
        ).encode()
    return Response(content, answer.status_code, _headers_of(gateway, answer))


def _own_answer_of(gateway: str, answer: httpx.Response) -> Response:
    """Give a gateway's answer as it is, from below its own path."""
    headers = {name: value for name, value in answer.headers.items() if name in _ANSWERED}
    return Response(answer.content, answer.status_code, {**headers, "X-Gateway": gateway})


def _answer_as(answer: httpx.Response) -> Response:
    """Give a gateway's answer as that of the plant."""
    headers = {name: value for name, value in answer.headers.items() if name in _ANSWERED}
    return Response(answer.content, answer.status_code, headers)


async def _pieces(answer: httpx.Response) -> AsyncIterator[bytes]:
    try:
        async for piece in answer.aiter_raw():
            yield piece
    except httpx.HTTPError:
        return
    finally:
        await answer.aclose()


async def _tell_error(request: Request, error: Any) -> Response:
    if isinstance(error, NotAuthenticated) and request.headers.get("sec-fetch-mode") == "navigate":
        return RedirectResponse(f"{request.scope.get('root_path', '')}{pages.SIGN_IN}", 303)
    problem = problem_of(error, request.url.path)
    headers = {"WWW-Authenticate": 'Bearer realm="motion-gateway"'} if problem.status == 401 else {}
    return response_to(problem, headers)


async def _tell_http_error(request: Request, error: Any) -> Response:
    return response_to(plain_problem(error.status_code, error.detail, request.url.path), error.headers)


async def _tell_fault(request: Request, _error: Exception) -> Response:
    problem = plain_problem(500, "The plant process itself has failed.", request.url.path)
    problem.moved = "unknown"
    problem.remedy = "Ask the gateway itself for status and position, and report the fault."
    return response_to(problem)
