"""All routes of robots."""

from api.common.routes import Router
from api.robots import info, jogs, moves, positions, settings, signals


def routers() -> list[Router]:
    """The routers of every module here."""
    modules = (info, moves, jogs, positions, settings, signals)
    return [module.router for module in modules]
