"""Routes for each row of the command tables, and for what has no routes in words of its own."""

from functools import cache

from api.common.documentation import WORDS
from api.common.requests import new_router
from api.common.routes import Router
from api.resources import resource_router
from api.walker import add
from gateway.core.family import Family
from gateway.door.commands import rows_of


@cache
def routers(family: type[Family]) -> list[Router]:
    """Make the routes of the whole table of a family."""
    made: dict[str, Router] = {}
    for operation in rows_of(family):
        add(made.setdefault(operation.tag, new_router(operation.tag)), operation)
    own = {place.path: place for place, _ in family.commands if place.path not in WORDS}
    return [*made.values(), *map(resource_router, own.values())]
