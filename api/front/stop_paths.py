"""The requests that may not wait: software stops, signs of life, and heartbeats of jogs."""

from typing import Final

from gateway.door.table import FAMILIES
from protocols.table import Effect

_STOPS = {
    row.name() for family in FAMILIES.values() for _, row in family.commands if row.effect is Effect.STOP
}
_LIFE_SIGN: Final = "/livez"
_HEARTBEAT: Final = "/heartbeat"
_ENDINGS: Final = ("/stop", *(f"/commands/{name}" for name in _STOPS))


def is_stop(method: str, path: str) -> bool:
    """Tell if a request stops something by software: a route `.../stop`, or a stop command's own route."""
    return method == "POST" and path.endswith(_ENDINGS)


def is_heartbeat(method: str, path: str) -> bool:
    """Tell if a request keeps a jog going, which ends half a second after the last one."""
    return method == "POST" and path.endswith(_HEARTBEAT)


def is_life_sign(method: str, path: str) -> bool:
    """Tell if a request asks for a sign of life: an orchestrator kills a process that gives none."""
    return method in ("GET", "HEAD") and path.endswith(_LIFE_SIGN)
