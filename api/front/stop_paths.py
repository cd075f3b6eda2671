"""Which requests are software stops: what may be refused to others is not refused to them."""

from typing import Final

from gateway.families import FAMILIES
from protocols.table import Effect

_STOPS = {
    row.name() for family in FAMILIES.values() for _, row in family.commands if row.effect is Effect.STOP
}
_ENDINGS: Final = ("/stop", *(f"/commands/{name}" for name in _STOPS))


def is_stop(method: str, path: str) -> bool:
    """Whether a request stops something by software: a route `.../stop`, or a stop command's own route."""
    return method == "POST" and path.endswith(_ENDINGS)
