"""Routes of a body's jogs, stored positions, inputs, outputs and captures."""

from api.bodies import captures, jogs, positions, signals
from api.common.routes import Router


def routers() -> list[Router]:
    """The routers of these modules."""
    return [module.router for module in (jogs, positions, signals, captures)]
