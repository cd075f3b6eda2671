"""All routes of SCARA robots."""

from api.common.routes import Router
from api.scaras import info, moves, paths


def routers() -> list[Router]:
    """The routers of every module here."""
    return [module.router for module in (info, moves, paths)]
