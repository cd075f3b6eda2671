"""Routes found by their words, where a search would try hundreds of patterns, one after the other."""

from collections import defaultdict
from collections.abc import Iterable
from typing import Final

from starlette.routing import BaseRoute
from starlette.types import ASGIApp, Receive, Scope, Send

from api.common.problems import path_of
from api.common.routes import HttpRoute
from gateway.door.table import Right

Key = tuple[str, int, str, str]
ANY: Final = ""
"""Stands for a last word that is a parameter."""


class RouteIndex:
    """Hands a request to its route by its method, and by count, first and last of the words of its path.

    Whatever it does not find goes to the router's own search, which knows what to answer then.
    """

    def __init__(self, routes: Iterable[BaseRoute], search: ASGIApp) -> None:
        self._search = search
        self._routes: defaultdict[Key, list[HttpRoute]] = defaultdict(list)
        for route in routes:
            if isinstance(route, HttpRoute):
                for method in route.methods or ():
                    self._routes[_key(method, route.path)].append(route)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let the request's route handle it."""
        route = self.find(scope) if scope["type"] == "http" else None
        if route is None:
            await self._search(scope, receive, send)
        else:
            await route.let_in(route.app, scope, receive, send)  # its method fits

    def right_of(self, scope: Scope) -> Right | None:
        """The right that the request's route takes; None where it has none here."""
        route = self.find(scope)
        return None if route is None else route.right

    def find(self, scope: Scope) -> HttpRoute | None:
        """Find the route of a request, and note in the scope what its path says."""
        path = path_of(scope) if scope.get("root_path") else scope["path"]
        key = _key(scope["method"], path)
        for it in (key, (*key[:3], ANY)):
            for route in self._routes.get(it, ()):
                found = route.path_regex.match(path)
                if found is not None:
                    params = found.groupdict()
                    for name, text in params.items():
                        params[name] = route.param_convertors[name].convert(text)
                    scope.update(endpoint=route.endpoint, path_params=params, route=route)
                    return route
        return None


def _key(method: str, path: str) -> Key:
    first, _, rest = path[1:].partition("/")
    last = rest.rpartition("/")[2]
    return method, path.count("/"), first, ANY if last.startswith("{") else last
