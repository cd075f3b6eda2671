"""All routes of robots."""

from api.common.routes import Router
from api.robots import info, jogs, macros, moves, positions, settings, signals, text_commands


def routers() -> list[Router]:
    """The routers of every module here."""
    modules = (info, moves, macros, jogs, positions, settings, signals, text_commands)
    return [module.router for module in modules]
