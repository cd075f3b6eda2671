"""The one way in: every check of a request once, in one order, and every error told as a problem.

Starlette's layers would do the same one around the other, each at its own price.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from starlette.middleware.cors import CORSMiddleware
from starlette.requests import Request
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket

from api.common.idempotent_requests import REPLAYED, relies_on_key
from api.common.problems import Telling
from api.common.request_ids import HEADER, has_begun
from api.common.security import SameSite, refusal
from api.walker import Walker

Layer = Callable[[ASGIApp], ASGIApp]


def open_to(origins: Sequence[str]) -> Layer:
    """Let pages of these origins read what they are answered."""
    return partial(
        CORSMiddleware,
        allow_origins=origins,
        allow_methods=["*"],
        allow_headers=["*"],
        expose_headers=[HEADER, REPLAYED],
    )


class Entrance:
    """Leads requests to their rows, and all else to the `others`; `idempotent` is for an Idempotency-Key."""

    def __init__(
        self,
        same_site: SameSite,
        rows: Walker,
        others: ASGIApp,
        telling: Mapping[type[Exception], Telling],
        *,
        for_pages: Layer | None = None,
        idempotent: Layer | None = None,
    ) -> None:
        self._same_site, self._rows, self._others, self._telling = same_site, rows, others, telling
        self._answering = for_pages(self._answer) if for_pages else self._answer
        self._idempotent = idempotent(self._answering) if idempotent else self._answering

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse, or pass on."""
        if scope["type"] == "lifespan":
            await self._others(scope, receive, send)
            return
        reason = self._same_site.reason_against(scope)
        if reason is not None:
            await refusal(scope, reason)(scope, receive, send)
        elif relies_on_key(scope, self._rows.right_of):
            await self._idempotent(scope, receive, send)
        else:
            await self._answering(scope, receive, send)

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            row = self._rows.find(scope) if scope["type"] == "http" else None
            if row is None:
                await self._others(scope, receive, send)
            else:
                await row.let_in(row.answer, scope, receive, send)
        except Exception as error:
            if has_begun(scope):
                raise
            await self._tell(error, scope, receive, send)

    async def _tell(self, error: Exception, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer with what went wrong; an error that was not foreseen is for the server's log, too."""
        of = Request if scope["type"] == "http" else WebSocket
        kind = next(kind for kind in type(error).__mro__ if kind in self._telling)
        answer = await self._telling[kind](of(scope, receive, send), error)
        await answer(scope, receive, send)
        if kind is Exception:
            raise error
        # Many requests may be told one and the same: what led to it would grow with each.
        error.__traceback__ = None
