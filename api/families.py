"""The families of controllers that have routes in words of their own, beside those of their commands."""

from collections.abc import Callable, Mapping
from typing import Final

from api.bodies import routes as bodies
from api.common.routes import Router
from api.robots import routes as robots
from api.scaras import routes as scaras
from gateway.core.family import Family
from gateway.fics.family import Fics
from gateway.rorze.family import Rorze

OWN_ROUTES: Final[Mapping[type[Family], Callable[[], list[Router]]]] = {
    Rorze: lambda: [*scaras.routers(), *bodies.routers()],
    Fics: robots.routers,
}
"""One that has none needs no entry: its commands are served, its moves, stops and events."""
