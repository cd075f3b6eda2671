"""Routes of a body's jogs, stored positions, inputs and outputs."""

from api.bodies import jogs, positions, signals
from api.common.routes import Router


def routers() -> list[Router]:
    """The routers of these modules."""
    return [module.router for module in (jogs, positions, signals)]
