"""Routes, each with the right that using it takes: there is none without, and no way past the hook."""

from collections.abc import Iterable, Iterator
from typing import Any, Final

from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute
from starlette.types import ASGIApp, Receive, Scope, Send

from api.common.access import CLOSE_NOT_AUTHENTICATED, Access, while_it_holds
from gateway.door.table import Right

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


class SocketRoute(Guarded, WebSocketRoute):
    """A WebSocket; who does not have its right is refused before it is opened."""


class PageRoute(Guarded, Route):
    """A document or a redirection: no operation. A browser that opens one sends its cookie alone."""

    cookie_suffices = True


def unguarded(routes: Iterable[BaseRoute]) -> Iterator[BaseRoute]:
    """Give every route without a right, those of mounted applications too."""
    for route in routes:
        if not isinstance(route, Guarded):
            yield route
        yield from unguarded(route.routes if isinstance(route, Mount) else ())
