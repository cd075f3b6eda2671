"""Routes found by their words, where a search would try hundreds of patterns, one after the other."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import Final

from starlette.routing import BaseRoute
from starlette.types import ASGIApp, Receive, Scope, Send

from api.common.problems import path_of
from api.common.routes import HttpRoute
from gateway.door.table import Right

KNOWN_PATHS: Final = 1024
"""Paths that were asked for of late, by clients who ask the same again and again."""
LONGEST_KNOWN: Final = 100
"""Characters of a path; longer ones are rare, and would take memory."""
ANY: Final = ""
"""Stands for a last word that is a parameter."""


class RouteIndex:
    """Hands a request to its route by its method, and by count, first and last of the words of its path.

    A request for which it finds none goes to the router's own search, which knows the answer.
    """

    def __init__(self, routes: Iterable[BaseRoute], search: ASGIApp) -> None:
        self._search = search
        self._found = lru_cache(KNOWN_PATHS)(self._find)
        self._routes: defaultdict[tuple[str | int, ...], list[HttpRoute]] = defaultdict(list)
        for route in routes:
            if isinstance(route, HttpRoute):
                words = route.path.split("/")
                last = ANY if words[-1].startswith("{") else words[-1]
                for method in route.methods or ():
                    self._routes[method, len(words), *words[1:2], last].append(route)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let the request's route handle it."""
        route = self.find(scope) if scope["type"] == "http" else None
        if route is None:
            await self._search(scope, receive, send)
        else:
            await route.let_in(route.answer, scope, receive, send)  # its method fits

    def right_of(self, scope: Scope) -> Right | None:
        """The right that the request's route takes; None where it has none here."""
        route = self.find(scope)
        return None if route is None else route.right

    def find(self, scope: Scope) -> HttpRoute | None:
        """Find the route of a request, and note in the scope what its path says."""
        path = path_of(scope) if scope.get("root_path") else scope["path"]
        find = self._found if len(path) <= LONGEST_KNOWN else self._find
        route, params = find(scope["method"], path)
        if route is not None:
            scope["endpoint"], scope["path_params"], scope["route"] = route.endpoint, dict(params), route
        return route

    def _find(self, method: str, path: str) -> tuple[HttpRoute | None, Mapping[str, str]]:
        words = path.split("/")
        for last in (words[-1], ANY):
            for route in self._routes.get((method, len(words), *words[1:2], last), ()):
                params = route.params_in(words)
                if params is not None:
                    return route, params
        return None, {}
