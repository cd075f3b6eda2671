"""Routes of a body's jogs and stored positions."""

from api.bodies import jogs, positions
from api.common.routes import Router


def routers() -> list[Router]:
    """The routers of these modules."""
    return [module.router for module in (jogs, positions)]
