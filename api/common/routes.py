"""Routes, each with the right that using it takes: there is none without, and no way past the hook."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, TypeVar

from fastapi.routing import APIRoute
from starlette.routing import BaseRoute, Match, Mount, Route, WebSocketRoute
from starlette.types import ASGIApp, Receive, Scope, Send

from api.common.access import CLOSE_NOT_AUTHENTICATED, Access, while_it_holds
from api.common.problems import DECLARED, path_of
from gateway.door.table import Right

Endpoint = TypeVar("Endpoint", bound=Callable[..., Any])

_END_OF_SOCKET: Final = {
    "type": "websocket.close",
    "code": CLOSE_NOT_AUTHENTICATED,
    "reason": "the key or the session has ended",
}
_END_OF_STREAM: Final = {"type": "http.response.body", "body": b"", "more_body": False}


class Guarded(BaseRoute):
    """A route that asks the access hook for its right as soon as it was found, before it reads a body."""

    def __init__(self, *args: Any, right: Right, any_scope: bool = False, **options: Any) -> None:
        self.right = Right(right)
        self.any_scope = any_scope
        super().__init__(*args, **options)

    cookie_suffices = False
    """True if a session needs no second secret here."""

    async def handle(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse, or do what the route does."""
        await self.let_in(super().handle, scope, receive, send)

    def is_open_to(self, scope: Scope) -> bool:
        """Tell if a request may use it, by all but its body."""
        access: Access = scope["app"].access
        return access.permits(scope, self.right, any_scope=self.any_scope)

    async def let_in(self, app: ASGIApp, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse, or let an application answer."""
        access: Access = scope["app"].access
        suffices = self.cookie_suffices
        passage = access.require(scope, self.right, any_scope=self.any_scope, cookie_suffices=suffices)
        with passage:
            handling = app(scope, receive, send)
            if passage.holds is None:
                await handling
            elif not await while_it_holds(passage.holds, handling):
                await send(_END_OF_SOCKET if scope["type"] == "websocket" else _END_OF_STREAM)


class HttpRoute(Guarded, APIRoute):
    """An operation, which its OpenAPI entry shows with its right.

    FastAPI only describes it, and builds it for that when it has to: that takes long, and hundreds are never
    described. `told` gives what only the document shows, with FastAPI's names.
    """

    def __init__(
        self,
        path: str,
        endpoint: Callable[..., Any],
        *,
        right: Right,
        any_scope: bool = False,
        told: Callable[[], Mapping[str, Any]] = dict,
        **options: Any,
    ) -> None:
        self.right, self.any_scope = Right(right), any_scope
        self.path, self.endpoint = path, endpoint
        self.methods = set(options.get("methods", ("GET",)))
        self._told, self._options = told, options
        self._built = False
        self._words = path.split("/")
        self._named = [(at, word[1:-1]) for at, word in enumerate(self._words) if word.startswith("{")]
        self._fixed = [(at, word) for at, word in enumerate(self._words) if not word.startswith("{")]

    def __getattr__(self, name: str) -> Any:
        """Build what a route of FastAPI has, as soon as any of it is wanted."""
        if name.startswith("__") or self._built:
            raise AttributeError(name)
        self.build()
        return getattr(self, name)

    def build(self) -> None:
        """Let FastAPI build it, to be described."""
        self._built = True
        options = {
            **self._options,
            **self._told(),
            "openapi_extra": {"x-right": self.right, **self.own_entry},
        }
        super().__init__(self.path, self.endpoint, right=self.right, any_scope=self.any_scope, **options)
        self.app = self.answer

    @property
    def in_document(self) -> bool:
        """True if the OpenAPI document has it."""
        return bool(self._options.get("include_in_schema", True))

    @property
    def own_entry(self) -> dict[str, Any]:
        """The parts of its OpenAPI entry that FastAPI does not find."""
        told = {**self._options, **self._told()}.get("openapi_extra") or {}
        return {**({"security": []} if self.right is Right.OPEN else {}), **told}

    async def answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Do what the operation does, for a request that was let in."""
        raise NotImplementedError

    def params_in(self, words: Sequence[str]) -> dict[str, str] | None:
        """The parameters in the words of a path; None where the path is another's."""
        if len(words) != len(self._words):
            return None
        for at, word in self._fixed:
            if words[at] != word:
                return None
        params = {name: words[at] for at, name in self._named}
        return params if all(params.values()) else None

    def matches(self, scope: Scope) -> tuple[Match, Scope]:
        """Tell whether a request is for this route; one for another need not be built for that."""
        if self.params_in(path_of(scope).split("/")) is None:
            return Match.NONE, {}
        return super().matches(scope)


class SocketRoute(Guarded, WebSocketRoute):
    """A WebSocket; who does not have its right is refused before it is opened.

    FastAPI would keep two exit stacks and a search for dependencies for as long as each client stays.
    """


class PageRoute(Guarded, Route):
    """A document or a redirection: no operation. A browser that opens one sends its cookie alone."""

    cookie_suffices = True


class Router:
    """The routes of one tag. The application takes them side by side with all others."""

    def __init__(self, tag: str, route_class: type[HttpRoute]) -> None:
        self.tag = tag
        self.routes: list[BaseRoute] = []
        self._route_class = route_class

    def add(
        self,
        method: str,
        path: str,
        right: Right,
        endpoint: Callable[..., Any],
        **options: Any,
    ) -> HttpRoute:
        """Add an operation, named as its endpoint if nothing else is said; `options` are those of FastAPI."""
        route = self._route_class(
            path,
            endpoint,
            right=right,
            methods=[method],
            tags=[self.tag],
            generate_unique_id_function=_name_of,
            **{"responses": DECLARED, **options},
        )
        self.routes.append(route)
        return route

    def get(self, path: str, right: Right, **options: Any) -> Callable[[Endpoint], Endpoint]:
        """Register the function below for GET."""
        return self._registering("GET", path, right, options)

    def post(self, path: str, right: Right, **options: Any) -> Callable[[Endpoint], Endpoint]:
        """Register the function below for POST."""
        return self._registering("POST", path, right, options)

    def websocket(self, path: str, right: Right) -> Callable[[Endpoint], Endpoint]:
        """Register the function below for a WebSocket."""

        def register(endpoint: Endpoint) -> Endpoint:
            self.routes.append(SocketRoute(path, endpoint, right=right))
            return endpoint

        return register

    def _registering(
        self, method: str, path: str, right: Right, options: dict[str, Any]
    ) -> Callable[[Endpoint], Endpoint]:
        def register(endpoint: Endpoint) -> Endpoint:
            self.add(method, path, right, endpoint, **options)
            return endpoint

        return register


def _name_of(route: APIRoute) -> str:
    """Name an operation as clients in most languages do: startMove."""
    first, *others = route.name.split("_")
    return first + "".join(map(str.capitalize, others))


def unguarded(routes: Iterable[BaseRoute]) -> Iterator[BaseRoute]:
    """Give every route without a right, those of mounted applications too."""
    for route in routes:
        if not isinstance(route, Guarded):
            yield route
        yield from unguarded(route.routes if isinstance(route, Mount) else ())
