"""Routes whose requests say everything in their path, answered without FastAPI's search for parameters."""

from typing import Any

from fastapi import Request
from starlette.types import Receive, Scope, Send

from api.common.query_params import require_known
from api.common.routes import HttpRoute


class DirectRoute(HttpRoute):
    """Calls its endpoint with the request and the words of the path, all of them plain text.

    FastAPI looks for dependencies, queries, headers and a body at every request, which takes longer than all
    the rest of a read. No query is known here.
    """

    def __init__(self, path: str, endpoint: Any, **options: Any) -> None:
        super().__init__(path, endpoint, **options)
        self.app = self._answer

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        request = Request(scope, receive, send)
        require_known(request, ())
        response = await self.endpoint(request, **scope["path_params"])
        await response(scope, receive, send)
